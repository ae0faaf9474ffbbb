"""The history of runs in SQLite: verdicts, worst errors and times of cases; series, and steps in them.

Of each case and stage the worst error over its limit is kept, over all configurations and references, with the check
that it comes from. Runs are appended whole or not at all, under the commit that the CI service or git names. A series
of measurements is searched for steps, that is changes for good: change points in its logarithm, by absolute deviations.
The last run is compared with those before it, and what became worse is said in sentences.
"""

import json
import math
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.reports.program_name import called
from rayproof.reports.results.case_records import CaseRecord, Check, Measurement
from rayproof.reports.results.files import at_worst, encodable
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.provenance import git
from rayproof.reports.results.provenance import machine as this_machine
from rayproof.reports.results.records import RunRecord, SeriesRecord, WorseRecord

APPLICATION = 0x52415950  # "RAYP" in SQLite's header: says that the file is ours
VERSION = 1
WAIT = 30.0  # s for another run that is appending

_TABLES = """
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, started TEXT NOT NULL, revision TEXT NOT NULL, subject TEXT NOT NULL, command TEXT NOT NULL,
    machine TEXT NOT NULL, verdict TEXT NOT NULL, finished INTEGER NOT NULL, seconds REAL, environment TEXT NOT NULL
);
CREATE TABLE cases (
    run INTEGER NOT NULL REFERENCES runs (id), name TEXT NOT NULL, verdict TEXT NOT NULL, seconds REAL,
    subject_seconds REAL, PRIMARY KEY (run, name)
) WITHOUT ROWID;
CREATE TABLE errors (
    run INTEGER NOT NULL REFERENCES runs (id), name TEXT NOT NULL, stage TEXT NOT NULL, ratio REAL NOT NULL,
    error REAL, place TEXT NOT NULL, PRIMARY KEY (run, name, stage)
) WITHOUT ROWID;
"""
# Of cases with wrong pixels the largest number in one check; files of earlier versions lack it until a run is appended.
_WRONG = """CREATE TABLE IF NOT EXISTS wrong (
    run INTEGER NOT NULL REFERENCES runs (id), name TEXT NOT NULL, pixels INTEGER NOT NULL, PRIMARY KEY (run, name)
) WITHOUT ROWID"""


class HistoryError(ValueError):
    """A history file that cannot be used; one line that names it."""


@contextmanager
def opened(path: Path, *, create: bool = False) -> Iterator[sqlite3.Connection]:
    """Give a connection to a history file; what the body writes is kept if it does not raise.

    Raises:
        HistoryError: there is no such file (unless `create`), or it is no history, or of another version.

    """
    if not create and not path.is_file():
        raise HistoryError(f"{path}: there is no such history; {called()} run --history {path} begins one")
    try:
        with closing(sqlite3.connect(path, timeout=WAIT)) as connection, connection:
            _prepare(connection, path)
            yield connection
    except (sqlite3.Error, UnicodeDecodeError) as error:
        why = " ".join(str(error).split())  # SQLite quotes a broken schema with its line ends
        raise HistoryError(f"{path}: cannot be used as a history: {why}") from None


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    connection.execute("BEGIN")
    application, version, tables = _marks(connection)
    if application == 0 and tables == 0:
        connection.rollback()
        connection.execute("BEGIN IMMEDIATE")  # of two runs that find nothing one makes it, and the other waits
        application, version, tables = _marks(connection)
    if application == 0 and tables == 0:
        for statement in _TABLES.split(";")[:-1]:
            connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION}")
        connection.execute(f"PRAGMA user_version = {VERSION}")
    elif application != APPLICATION:
        raise HistoryError(f"{path}: is a database of something else")
    elif version != VERSION:
        raise HistoryError(f"{path}: is a history of version {version}, this is version {VERSION}")
    connection.commit()


def _marks(connection: sqlite3.Connection) -> tuple[int, int, int]:
    """Return the database's application and version, and how many tables it has."""
    asked = ("PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_master")
    application, version, tables = (int(connection.execute(one).fetchone()[0]) for one in asked)
    return application, version, tables


def append(path: Path, results: RunRecord, revision: str) -> int:
    """Append a run's results, as docs/results.md describes them, and return its number.

    Raises:
        HistoryError: the file cannot be used.

    """
    with opened(path, create=True) as connection:
        environment = json.dumps(results.get("environment", {}), sort_keys=True)
        cursor = connection.execute(
            "INSERT INTO runs (started, revision, subject, command, machine, verdict, finished, seconds, environment)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            storable(
                results["started"],
                revision,
                str(results.get("subject", "tracer")),
                results.get("command", ""),
                this_machine(),
                results["verdict"],
                bool(results.get("finished", True)),
                results.get("seconds"),
                environment,
            ),
        )
        run = int(cursor.lastrowid or 0)
        connection.executemany(
            "INSERT INTO cases VALUES (?, ?, ?, ?, ?)", (storable(*_case(run, c)) for c in results["cases"])
        )
        connection.executemany(
            "INSERT INTO errors VALUES (?, ?, ?, ?, ?, ?)",
            (storable(*row) for c in results["cases"] for row in _errors(run, c)),
        )
        connection.execute(_WRONG)
        wrong = ((case["name"], wrong_pixels(case)) for case in results["cases"])
        connection.executemany(
            "INSERT INTO wrong VALUES (?, ?, ?)", (storable(run, name, pixels) for name, pixels in wrong if pixels)
        )
    return run


def wrong_pixels(case: CaseRecord) -> int:
    """Return the largest number of pixels over their limit in one check of a case."""
    return max((check.examined.wrong for check in case.get("checks", []) if check.examined), default=0)


def storable(*values: Any) -> tuple[Any, ...]:
    """Return values as SQLite takes them: of an undecodable file name what reports.results.files makes of it."""
    return tuple(encodable(one) if isinstance(one, str) else one for one in values)


def _case(run: int, case: CaseRecord) -> tuple[int, str, str, float | None, float]:
    """Return a case's row; the references' renders are not the subject's time."""
    mine = (r.get("seconds") or 0.0 for r in case.get("renders", []) if r.get("configuration") is not None)
    return run, case["name"], case["verdict"], case.get("seconds"), sum(mine)


def _errors(run: int, case: CaseRecord) -> Iterator[tuple[int, str, str, float, float | None, str]]:
    worst: dict[str, tuple[float, Check, Measurement]] = {}
    for check in case.get("checks", []):
        measured = check.continued or check.end_to_end
        if measured is None:
            continue
        ratio = at_worst(check.ratio)
        if check.stage not in worst or ratio > worst[check.stage][0]:
            worst[check.stage] = (ratio, check, measured)
    for stage, (ratio, check, measured) in worst.items():
        error = at_worst(off) if (off := measured.worst_error) is not None else None
        place = f"{check.configuration} {check.reference}"
        yield run, case["name"], stage, ratio, error if error is None or math.isfinite(error) else None, place


CI_VARIABLES = ("GITHUB_SHA", "CI_COMMIT_SHA", "GIT_COMMIT", "BUILD_SOURCEVERSION")  # GitHub, GitLab, Jenkins, Azure


def revision() -> str:
    """Return a commit's id, with "+" where files differ from it; "" where it is unknown."""
    named = next((os.environ[name] for name in CI_VARIABLES if os.environ.get(name)), "")
    if named:
        return named[:40]
    commit = git("rev-parse", "HEAD")
    if not commit:
        return ""
    changed = git("status", "--porcelain", "--untracked-files=no")
    return f"{commit}{'+' if changed else ''}"


NORMAL = 1.4826  # standard deviations in a median absolute deviation of normal noise
FEWEST = 4  # values below which no noise can be told from a step


@dataclass(frozen=True, kw_only=True)
class Step:
    """A change of level: the index of the first value after it, and the medians on both sides."""

    at: int
    before: float
    after: float

    @property
    def factor(self) -> float:
        """Return how many times the level was multiplied."""
        return self.after / self.before if self.before else float("inf")


def spread(values: np.ndarray) -> float:
    """Return the standard deviation of noise in a series of logarithms, steps aside (0 where all are equal)."""
    differences = np.diff(values)
    if not len(differences):
        return 0.0
    # A difference of two noisy values has twice the variance.
    return float(NORMAL * np.median(np.abs(differences - np.median(differences))) / np.sqrt(2))


def changes(series: Sequence[float], *, least: float) -> list[Step]:
    """Return the steps of positive numbers without noise, which equal code makes equal: where neighbours differ.

    `least` is the factor below which a step is of no interest (1.1: a tenth).
    """
    return [
        Step(at=at, before=before, after=after)
        for at, (before, after) in enumerate(pairwise(series), start=1)
        if abs(np.log(after / before)) >= np.log(least)
    ]


def steps(series: Sequence[float], *, least: float) -> list[Step]:
    """Return the steps of a series of noisy positive numbers, oldest first; each is held by two values at least.

    `least` is the factor below which a step is of no interest (1.2: a fifth).
    """
    import ruptures

    values = np.log(np.asarray(series, dtype=np.float64))
    if len(values) < FEWEST:
        return []
    # Noise below a tenth of what is of interest cannot make a step of interest.
    sigma = max(spread(values), np.log(least) / 10)
    search = ruptures.Pelt(model="l1", min_size=2, jump=1).fit(values.reshape(-1, 1))
    ends = search.predict(pen=2 * sigma * np.log(len(values)))
    levels = [float(np.median(values[low:high])) for low, high in pairwise([0, *ends])]
    return [
        Step(at=at, before=float(np.exp(before)), after=float(np.exp(after)))
        for at, before, after in zip(ends[:-1], levels[:-1], levels[1:], strict=True)
        if abs(after - before) >= np.log(least)
    ]


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


LOUD = 4.0  # standard deviations; of 151 cases one in a hundred runs is flagged by chance


def worse(series: Sequence[Series], run: int) -> list[WorseRecord]:
    """Return what is worse in `run` than before: `case`, `what` (verdict, error or time), `sentence`, `factor`."""
    found = []
    for one in series:
        if one.points[-1].run == run and len(one.points) > 1:
            found += [entry for entry in (_verdict(one), _error(one), _time(one)) if entry is not None]
    return sorted(found, key=lambda entry: -at_worst(entry["factor"]))


def more_wrong(connection: sqlite3.Connection, run: int) -> list[WorseRecord]:
    """Return the cases with a tenth more wrong pixels than in the run of their subject before, if that had some."""
    rows = connection.execute(
        "SELECT w.name, w.pixels, o.pixels, o.run FROM wrong w JOIN wrong o ON o.name = w.name AND o.run = ("
        "SELECT max(c.run) FROM cases c JOIN runs r ON r.id = c.run WHERE c.name = w.name AND c.run < w.run"
        " AND r.subject = (SELECT subject FROM runs WHERE id = w.run)) WHERE w.run = ?",
        (run,),
    )
    return [
        {
            "case": name,
            "what": "pixels",
            "factor": now / before,
            "sentence": f"{name}: {now} wrong pixels, were {before} in run {earlier}",
        }
        for name, now, before, earlier in rows
        if now > WORSE_ERROR * before
    ]


def _entry(one: Series, what: str, factor: float, sentence: str) -> WorseRecord:
    return {"case": one.name, "what": what, "factor": factor, "sentence": f"{one.name}: {sentence}"}


def _since(point: Point) -> str:
    return f"run {point.run}{f' ({point.revision[:10]})' if point.revision else ''}"


def _verdict(one: Series) -> WorseRecord | None:
    order = list(Outcome)
    before, now = one.points[-2], one.points[-1]
    if order.index(Outcome(now.verdict)) <= order.index(Outcome(before.verdict)):
        return None
    return _entry(one, "verdict", float("inf"), f"{now.verdict}, was {before.verdict} in {_since(before)}")


def _error(series: Series) -> WorseRecord | None:
    before, now = series.points[-2], series.points[-1]
    # Below a hundredth of the limit an error is nobody's business.
    if now.ratio is None or before.ratio is None or now.ratio < 0.01 or not now.ratio > WORSE_ERROR * before.ratio:
        return None
    factor = now.ratio / before.ratio if before.ratio else float("inf")
    said = (
        f"worst error / limit {now.ratio:.3g} at {now.stage} ({now.place}), was {before.ratio:.3g} in {_since(before)}"
    )
    return _entry(series, "error", factor, said)


def _time(series: Series) -> WorseRecord | None:
    now = series.points[-1]
    earlier = [point.seconds for point in series.points[:-1] if point.machine == now.machine and point.seconds > 0]
    if series.time_steps:  # only what came after the last step is the level of today
        start = series.time_steps[-1].at
        earlier = [p.seconds for p in series.points[start:-1] if p.machine == now.machine and p.seconds > 0] or earlier
    if len(earlier) < FEWEST or not now.seconds > 0:
        return None
    logarithms = np.log(earlier)
    level = float(np.median(logarithms))
    noise = NORMAL * float(np.median(np.abs(logarithms - level)))
    excess = float(np.log(now.seconds)) - level
    if excess <= max(LOUD * noise, np.log(WORSE_TIME)):
        return None
    said = f"{now.seconds:.3g} s, median of {len(earlier)} runs before {np.exp(level):.3g} s"
    return _entry(series, "time", float(np.exp(excess)), said)


SHOWN = 50  # runs of each case that a report draws


def keep(path: Path, results: RunRecord) -> list[str]:
    """Append `results` to the history `path`, put `history` into them, and return what became worse, in sentences.

    Raises:
        HistoryError: the file cannot be used.

    """
    run = append(path, results, revision())
    with opened(path) as connection:
        series = read_series(connection, str(results.get("subject", "tracer")))
        found = [*worse(series, run), *more_wrong(connection, run)]
    results["history"] = {"file": path.name, "run": run, "worse": found, "cases": {s.name: drawn(s) for s in series}}
    return [entry["sentence"] for entry in found]


def drawn(series: Series) -> SeriesRecord:
    """Return what a report draws of a case: its last points and the steps among them, by run."""
    points = series.points[-SHOWN:]
    return {
        "points": [(p.run, p.revision[:10], p.verdict, p.ratio, p.seconds) for p in points],
        "error_steps": [(series.points[step.at].run, step.factor) for step in series.error_steps],
        "time_steps": [(series.points[step.at].run, step.factor) for step in series.time_steps],
    }
