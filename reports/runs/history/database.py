"""The results database: one SQLite file, a row a run, and for each of its cases verdict, worst errors and times.

Of each case and stage the worst error over its limit is kept, over all configurations and references, with the check
that it comes from. Runs are appended whole or not at all.
"""

import json
import math
import os
import platform
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from rayproof.reports.called import called
from rayproof.reports.results.json_numbers import at_worst, encodable
from rayproof.reports.results.records import CaseRecord, RunRecord

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
                machine(),
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
    return run


def storable(*values: Any) -> tuple[Any, ...]:
    """Return values as SQLite takes them: of an undecodable file name what reports.results.atomic makes of it."""
    return tuple(encodable(one) if isinstance(one, str) else one for one in values)


def machine() -> str:
    """Return what times may be compared within: the processor and how many of it there are."""
    return f"{platform.machine()} {_processor()} x{os.cpu_count()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def _case(run: int, case: CaseRecord) -> tuple[int, str, str, float | None, float]:
    """Return a case's row; the references' renders are not the subject's time."""
    mine = (r.get("seconds") or 0.0 for r in case.get("renders", []) if r.get("configuration") is not None)
    return run, case["name"], case["verdict"], case.get("seconds"), sum(mine)


def _errors(run: int, case: CaseRecord) -> Iterator[tuple[int, str, str, float, float | None, str]]:
    worst: dict[str, tuple[float, Mapping[str, Any], Mapping[str, Any]]] = {}
    for check in case.get("checks", []):
        measured = check.get("continued") or check.get("end_to_end")
        if measured is None:
            continue
        ratio = at_worst(check["ratio"])
        if check["stage"] not in worst or ratio > worst[check["stage"]][0]:
            worst[check["stage"]] = (ratio, check, measured)
    for stage, (ratio, check, measured) in worst.items():
        error = at_worst(measured["worst_error"]) if measured.get("worst_error") is not None else None
        place = f"{check['configuration']} {check['reference']}"
        yield run, case["name"], stage, ratio, error if error is None or math.isfinite(error) else None, place
