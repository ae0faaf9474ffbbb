"""The history of runs in SQLite: verdict, worst error, wrong pixels and time of each case, and changes for the worse.

For each case the largest ratio of error to limit is stored, with the check that has it. A run is appended completely or
not at all, with the commit from the CI service's variables or git. It is compared with the ten runs before it, without
itself: a value outside their spread is worse.
"""

import json
import math
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rayproof.reports.program_name import called
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import at_worst, encodable
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.provenance import git
from rayproof.reports.results.provenance import machine as this_machine
from rayproof.reports.results.records import RunRecord, WorseRecord

APPLICATION = 0x52415950  # "RAYP" in SQLite's header, which marks the file as a history of this program
VERSION = 1
WAIT = 30.0  # s to wait while another run is appending

_TABLES = (
    """CREATE TABLE IF NOT EXISTS runs (
    id INTEGER PRIMARY KEY, started TEXT NOT NULL, revision TEXT NOT NULL, subject TEXT NOT NULL, command TEXT NOT NULL,
    machine TEXT NOT NULL, verdict TEXT NOT NULL, finished INTEGER NOT NULL, seconds REAL, environment TEXT NOT NULL
)""",
    """CREATE TABLE IF NOT EXISTS cases (
    run INTEGER NOT NULL REFERENCES runs (id), name TEXT NOT NULL, verdict TEXT NOT NULL, seconds REAL NOT NULL,
    ratio REAL, stage TEXT NOT NULL, place TEXT NOT NULL, wrong INTEGER NOT NULL, PRIMARY KEY (run, name)
) WITHOUT ROWID""",
    f"PRAGMA application_id = {APPLICATION}",
    f"PRAGMA user_version = {VERSION}",
)


class HistoryError(ValueError):
    """A history file cannot be used; the message is one line with its name."""


@contextmanager
def opened(path: Path, *, create: bool = False) -> Iterator[sqlite3.Connection]:
    """Yield a connection to a history file; the changes that the body makes are committed unless it raises.

    Raises:
        HistoryError: the file does not exist (unless `create`), is no history, or has another version.

    """
    if not create and not path.is_file():
        raise HistoryError(f"{path}: there is no such history; {called()} run --history {path} begins one")
    try:
        with closing(sqlite3.connect(path, timeout=WAIT)) as connection, connection:
            _prepare(connection, path)
            yield connection
    except (sqlite3.Error, UnicodeDecodeError, msgspec.ValidationError) as error:
        why = " ".join(str(error).split())  # SQLite quotes a broken schema with its line breaks
        raise HistoryError(f"{path}: cannot be used as a history: {why}") from None


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    """Create the tables of an empty file; raise HistoryError for a file that is no history of this version."""
    connection.execute("BEGIN")  # read all three values in one transaction
    queries = ("PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_master")
    application, version, tables = (int(connection.execute(query).fetchone()[0]) for query in queries)
    connection.rollback()
    if application == 0 and tables == 0:
        connection.execute("BEGIN IMMEDIATE")  # if two runs open an empty file, the second one waits
        for statement in _TABLES:
            connection.execute(statement)
        connection.commit()
    elif application != APPLICATION:
        raise HistoryError(f"{path}: is a database of something else")
    elif version != VERSION:
        raise HistoryError(f"{path}: is a history of version {version}, this is version {VERSION}")


def append(path: Path, results: RunRecord, revision: str) -> int:
    """Append a run's results, as docs/results.md describes them, and return its number.

    Raises:
        HistoryError: the file cannot be used.

    """
    with opened(path, create=True) as connection:
        subject, command = str(results.get("subject", "tracer")), results.get("command", "")
        finished, environment = results.get("finished", True), json.dumps(results.get("environment", {}))
        facts = (subject, command, this_machine(), results["verdict"], finished, results.get("seconds"), environment)
        cursor = connection.execute(
            "INSERT INTO runs (started, revision, subject, command, machine, verdict, finished, seconds, environment)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            storable(results["started"], revision, *facts),
        )
        run = int(cursor.lastrowid or 0)
        rows = (storable(run, *_row(case)) for case in results["cases"])
        connection.executemany("INSERT INTO cases VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return run


def storable(*values: Any) -> tuple[Any, ...]:
    """Return values that SQLite accepts: undecodable characters of file names are escaped."""
    return tuple(encodable(value) if isinstance(value, str) else value for value in values)


def _row(case: CaseRecord) -> tuple[str, str, float, float | None, str, str, int]:
    """Return name, verdict, time [s], largest error over limit with its stage and check, and most wrong pixels."""
    # The references' renders have no configuration; their time is not the subject's.
    renders = [render for render in case.get("renders", []) if render.get("configuration") is not None]
    seconds = float(sum(render.get("seconds") or 0.0 for render in renders))
    measured = [check for check in case.get("checks", []) if check.continued or check.end_to_end]
    worst = max(measured, key=lambda check: at_worst(check.ratio), default=None)
    wrong = max((check.examined.wrong for check in case.get("checks", []) if check.examined), default=0)
    ratio = None if worst is None else at_worst(worst.ratio)
    stage, place = ("", "") if worst is None else (str(worst.stage), f"{worst.configuration} {worst.reference}")
    return case["name"], case["verdict"], seconds, ratio, stage, place, wrong


CI_VARIABLES = ("GITHUB_SHA", "CI_COMMIT_SHA", "GIT_COMMIT", "BUILD_SOURCEVERSION")  # GitHub, GitLab, Jenkins, Azure


def revision() -> str:
    """Return the commit's id, with "+" if files differ from the commit; "" if it is unknown."""
    named = next((os.environ[name] for name in CI_VARIABLES if os.environ.get(name)), "")
    if named:
        return named[:40]
    commit = git("rev-parse", "HEAD")
    return f"{commit}+" if commit and git("status", "--porcelain", "--untracked-files=no") else commit


class HistoryPoint(msgspec.Struct, frozen=True, array_like=True):
    """The result of a case in a run."""

    run: int
    started: str
    revision: str
    machine: str
    verdict: Outcome
    seconds: float  # time of the subject's renders
    ratio: float | None  # largest error over its limit in all checks; None if nothing was measured
    stage: str  # stage of this error
    place: str  # configuration and reference of this error
    wrong: int  # wrong pixels in the check with the most


Series = Mapping[str, Sequence[HistoryPoint]]  # name of a case -> its points, the oldest first


def read_series(connection: sqlite3.Connection, subject: str) -> Series:
    """Return the results of every case over a subject's runs, finished or not."""
    rows = connection.execute(
        "SELECT c.name, r.id, r.started, r.revision, r.machine, c.verdict, c.seconds, c.ratio, c.stage, c.place,"
        " c.wrong FROM runs r JOIN cases c ON c.run = r.id WHERE r.subject = ? ORDER BY c.name, r.id",
        storable(subject),
    )
    series: dict[str, list[HistoryPoint]] = {}
    for name, *values in rows:
        series.setdefault(str(name), []).append(msgspec.convert(values, HistoryPoint))
    return series


LAST = 10  # earlier runs with which a run is compared
FEWEST = 4  # times that are needed to estimate their spread
LEAST_RATIO = 0.01  # a smaller ratio of error to limit is ignored
# The same code gives the same errors, so that every change of an error is a change of the arithmetic. A factor of 1.1
# is one additional rounding if a bound counts ten.
WORSE_ERROR = 1.1
# The median time of the default suite's cases differed by 1.15 between two runs of the same code, six minutes apart on
# a busy machine (`rayproof report A B`), so that smaller factors may be due to the load. The noise of a single case
# comes in addition, and is estimated.
WORSE_TIME = 1.2
NORMAL = 1.4826  # ratio of the standard deviation to the median absolute deviation of normal noise
LOUD = 4.0  # standard deviations; with 151 cases, one run in a hundred has a case that is worse by chance


def spread(values: Sequence[float]) -> tuple[float, float]:
    """Return the median of positive numbers, and the standard deviation of their logarithms.

    The standard deviation is estimated from the median absolute deviation; up to half of the numbers may be outliers
    without a large effect on either.
    """
    logarithms = np.log(values)
    level = float(np.median(logarithms))
    return math.exp(level), NORMAL * float(np.median(np.abs(logarithms - level)))


def errors(points: Sequence[HistoryPoint]) -> list[float]:
    """Return the ratios of error to limit of the last ten points that have one."""
    return [point.ratio for point in points if point.ratio is not None][-LAST:]


def timed(points: Sequence[HistoryPoint], machine: str) -> list[HistoryPoint]:
    """Return the last ten points that were timed on `machine`; times of other machines cannot be compared."""
    return [point for point in points if point.machine == machine and point.seconds > 0][-LAST:]


def worse(series: Series, run: int) -> list[WorseRecord]:
    """Return the changes for the worse in `run` since the ten runs before of each case, the largest factor first."""
    records: list[WorseRecord] = []
    for name, (*before, now) in series.items():
        if not before or now.run != run:
            continue
        for what, compare in (("verdict", _verdict), ("error", _error), ("pixels", _pixels), ("time", _time)):
            if (compared := compare(before, now)) is not None:
                factor, sentence = compared
                records.append({"case": name, "what": what, "factor": factor, "sentence": f"{name}: {sentence}"})
    return sorted(records, key=lambda record: -at_worst(record["factor"]))


def _verdict(before: Sequence[HistoryPoint], now: HistoryPoint) -> tuple[float, str] | None:
    """Compare the verdict with the one of the previous run; return the factor inf and a sentence, or None."""
    order, earlier = list(Outcome), before[-1]
    if order.index(now.verdict) <= order.index(earlier.verdict):
        return None
    commit = f" ({earlier.revision[:10]})" if earlier.revision else ""
    return math.inf, f"{now.verdict}, was {earlier.verdict} in run {earlier.run}{commit}"


def _error(before: Sequence[HistoryPoint], now: HistoryPoint) -> tuple[float, str] | None:
    """Compare the error with the largest of the last ten runs; the same code repeats it exactly, without noise."""
    most = max(errors(before), default=math.inf)
    if now.ratio is None or now.ratio < LEAST_RATIO or not now.ratio > WORSE_ERROR * most:
        return None
    sentence = (
        f"worst error / limit {now.ratio:.3g} at {now.stage} ({now.place}), at most {most:.3g} in the runs before"
    )
    return now.ratio / most if most else math.inf, sentence


def _pixels(before: Sequence[HistoryPoint], now: HistoryPoint) -> tuple[float, str] | None:
    """Compare the number of wrong pixels in the same way; if there were none before, the verdict shows the change."""
    most = max(point.wrong for point in before[-LAST:])
    if not most or not now.wrong > WORSE_ERROR * most:
        return None
    return now.wrong / most, f"{now.wrong} wrong pixels, at most {most} in the runs before"


def _time(before: Sequence[HistoryPoint], now: HistoryPoint) -> tuple[float, str] | None:
    """Compare the time with the median of the last ten runs; a slow run among them hardly changes the median."""
    earlier = timed(before, now.machine)
    if len(earlier) < FEWEST or not now.seconds > 0:
        return None
    level, noise = spread([point.seconds for point in earlier])
    excess = math.log(now.seconds / level)
    if excess <= max(LOUD * noise, math.log(WORSE_TIME)):
        return None
    return math.exp(excess), f"{now.seconds:.3g} s, median of {len(earlier)} runs before {level:.3g} s"


SHOWN = 50  # runs of each case that a report shows


def keep(path: Path, results: RunRecord) -> None:
    """Append `results` to the history `path`, and add `history` to them: changes for the worse, and the shown runs.

    Raises:
        HistoryError: the file cannot be used.

    """
    run = append(path, results, revision())
    with opened(path) as connection:
        series = read_series(connection, str(results.get("subject", "tracer")))
    cases = {
        name: [(point.run, point.revision[:10], point.verdict.value, point.ratio, point.seconds) for point in points]
        for name, points in ((name, points[-SHOWN:]) for name, points in series.items())
    }
    results["history"] = {"file": path.name, "run": run, "worse": worse(series, run), "cases": cases}
