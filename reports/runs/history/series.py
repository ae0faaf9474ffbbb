"""What a history holds of each case: its worst error and its run time, run by run, with the steps in both."""

import sqlite3
from dataclasses import dataclass

from rayproof.reports.runs.history.database import storable
from rayproof.reports.runs.history.steps import Step, changes, steps

LEAST_RATIO = 1e-6  # errors over their limit smaller than this are all the same: nothing
# Factors that are worth a word. Equal code gives equal errors: every change of one is a change of the arithmetic, and a
# tenth is one rounding more where a bound counts ten.
WORSE_ERROR = 1.1
# Two runs of equal code, six minutes apart on a busy machine, differed by 1.15 in the median time of the default
# suite's cases (`rayproof report A B`): less is the hour's. A single case's noise comes on top, and is estimated.
WORSE_TIME = 1.2


@dataclass(frozen=True, kw_only=True)
class Point:
    """One run's word on a case."""

    run: int
    started: str
    revision: str
    verdict: str
    ratio: float | None  # worst error over its limit, over all checks; None where nothing was measured
    stage: str
    place: str  # configuration and reference of the worst error
    seconds: float  # of the subject's renders
    machine: str


@dataclass(frozen=True, kw_only=True)
class Series:
    """A case's points, oldest first, and the steps among them; a step's `at` is an index into `points`."""

    name: str
    points: tuple[Point, ...]
    error_steps: tuple[Step, ...]
    time_steps: tuple[Step, ...]


def read_series(connection: sqlite3.Connection, subject: str) -> list[Series]:
    """Return the series of every case of a subject's finished and unfinished runs."""
    rows = connection.execute(
        "SELECT c.name, r.id, r.started, r.revision, c.verdict, c.subject_seconds, r.machine, e.ratio, e.stage, e.place"
        " FROM runs r JOIN cases c ON c.run = r.id LEFT JOIN errors e ON e.run = r.id AND e.name = c.name"
        " AND e.ratio = (SELECT max(ratio) FROM errors w WHERE w.run = r.id AND w.name = c.name)"
        " WHERE r.subject = ? GROUP BY c.name, r.id ORDER BY c.name, r.id",
        storable(subject),
    )
    found: dict[str, list[Point]] = {}
    for name, run, started, revision, verdict, seconds, machine, ratio, stage, place in rows:
        point = Point(
            run=run,
            started=started,
            revision=revision,
            verdict=verdict,
            ratio=ratio,
            stage=stage or "",
            place=place or "",
            seconds=seconds or 0.0,
            machine=machine,
        )
        found.setdefault(name, []).append(point)
    return [_series(name, points) for name, points in found.items()]


def _series(name: str, points: list[Point]) -> Series:
    last = points[-1].machine
    # Times of another machine tell nothing about this one's.
    same = [index for index, point in enumerate(points) if point.machine == last and point.seconds > 0]
    times = steps([points[index].seconds for index in same], least=WORSE_TIME)
    measured = [index for index, point in enumerate(points) if point.ratio is not None]
    ratios = [min(max(points[index].ratio or 0.0, LEAST_RATIO), 1 / LEAST_RATIO) for index in measured]
    return Series(
        name=name,
        points=tuple(points),
        error_steps=_placed(changes(ratios, least=WORSE_ERROR), measured),
        time_steps=_placed(times, same),
    )


def _placed(found: list[Step], indices: list[int]) -> tuple[Step, ...]:
    """Return steps by the index of the point at which each came, not by that of the values that were looked at."""
    return tuple(Step(at=indices[step.at], before=step.before, after=step.after) for step in found)
