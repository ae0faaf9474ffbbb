"""results.sqlite: a row per case, committed when the case is finished; lists, filters and later amendments.

The file is both the journal of a run and its results. Whole records are deflated and read one at a time, so that the
memory does not depend on the length of the run; the column `brief` contains the fields that lists show. Later additions
to a case (a picture, a cause) are written to a column of their own and override the record's fields on reading.
"""

import json
import sqlite3
import zlib
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from errno import EIO, ENOSPC, EROFS
from pathlib import Path
from typing import Any, cast, overload
from weakref import finalize

import msgspec

from rayproof.reports.results.case_records import CaseRecord, worst_ratio
from rayproof.reports.results.compact import compact_case, expand_case
from rayproof.reports.results.files import as_json
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import problem_of_case
from rayproof.reports.results.wrong_pixels import plain_reason, stated_reason, wrong_pixels

NAME = "results.sqlite"
APPLICATION = 0x52415952  # "RAYR" in SQLite's header: identifies the files of rayproof
VERSION = 1
WAIT = 30.0  # s, waiting for another process that is writing
LEVEL = 6  # of zlib
GAPS = 64  # unreadable rows after which salvaging stops
HELD = (
    2**24
)  # bytes of compact JSON whose records stay in memory: the default suite; further records are read again each time
LARGEST = 2**30  # bytes of a record; one that inflates to more is damaged
WORST = [outcome.value for outcome in Outcome]
# Fields of a case's record that no list shows.
HEAVY = frozenset({
    "renders", "checks", "adjudication", "masks", "expectations", "settings", "notes",
    "unsupported", "versions", "trace", "compared", "ran", "shapes",
})  # fmt: skip
_TABLES = (
    """CREATE TABLE cases (
    id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, place INTEGER, name TEXT NOT NULL, family TEXT NOT NULL,
    verdict TEXT NOT NULL, badness INTEGER NOT NULL, stage TEXT, item TEXT, ratio REAL, seconds REAL,
    brief TEXT NOT NULL, added TEXT, size INTEGER NOT NULL, record BLOB NOT NULL
)""",
    "CREATE INDEX names ON cases (name)",
    "CREATE TABLE run (document TEXT NOT NULL)",
    f"PRAGMA application_id = {APPLICATION}",
    f"PRAGMA user_version = {VERSION}",
)
_DAMAGED = (ValueError, TypeError, KeyError, AttributeError, zlib.error, OverflowError)


class DamagedTableError(ValueError):
    """A results.sqlite that cannot be read; the message is one line that names the file."""


class CaseTable:
    """One results.sqlite, open for reading and writing.

    Raises:
        DamagedTableError: the file is no results.sqlite, or is damaged.
        OSError: the file cannot be opened or written.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._held: dict[int, CaseRecord] = {}
        self._room = HELD
        with self._told():
            # Threads that draw pictures never use it, but garbage collection in another thread may close it.
            self._connection = sqlite3.connect(path, timeout=WAIT, check_same_thread=False, isolation_level=None)
            self.close = finalize(self, self._connection.close)  # also runs when the table is garbage-collected
            try:
                self._prepare()
            except BaseException:
                self.close()
                raise

    def _prepare(self) -> None:
        queries = ("PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_master")
        marks = [int(self._connection.execute(query).fetchone()[0]) for query in queries]
        self._connection.execute("PRAGMA trusted_schema = OFF")
        if marks == [0, 0, 0]:
            with self.writing():
                for statement in _TABLES:
                    self._connection.execute(statement)
        elif marks[:2] != [APPLICATION, VERSION]:
            raise DamagedTableError(f"{self.path}: is no results.sqlite of this version")

    def begin(self) -> None:
        """Remove everything of earlier runs but their finished cases; `keep` and `arrange` choose this run's cases."""
        with self.writing(), self._told():
            self._connection.execute("UPDATE cases SET place = NULL, added = NULL")
            self._connection.execute("DELETE FROM run")

    def keep(self, key: str, record: CaseRecord, *, place: int | None = None) -> None:
        """Write a finished case under its key, replacing an earlier record; with a `place`, as a case of the run."""
        text = as_json(compact_case(record)).encode()
        brief = {name: value for name, value in record.items() if name not in HEAVY}
        ratio = worst_ratio(record)
        brief["worst_ratio"] = ratio
        brief["wrong_pixels"] = wrong_pixels(record)
        if (stated := stated_reason(record)) != plain_reason(record.get("reason")):
            brief["stated"] = stated
        verdict = str(record.get("verdict", Outcome.MISSING.value))
        row = (
            key,
            str(record.get("name", "")),
            str(record.get("family", "")),
            verdict,
            WORST.index(verdict) if verdict in WORST else len(WORST),
            record.get("stage"),
            record.get("item"),
            ratio,
            record.get("seconds"),
            as_json(brief),
            len(text),
            zlib.compress(text, LEVEL),
            place,
        )
        with self._told():
            # A lone surrogate, from a file's name, cannot be encoded in UTF-8; JSON has escaped it.
            row = tuple(value.encode(errors="replace").decode() if isinstance(value, str) else value for value in row)
            cursor = self._connection.execute(
                "INSERT OR REPLACE INTO cases (key, name, family, verdict, badness, stage, item, ratio, seconds, brief,"
                " size, record, place) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                row,
            )
        self._hold(int(cursor.lastrowid or 0), record, len(text))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Commit everything that the body writes, or nothing if it raises."""
        with self._told():
            self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            with suppress(sqlite3.Error):
                self._connection.execute("ROLLBACK")
            self._forget()
            raise
        with self._told():
            self._connection.execute("COMMIT")

    def finished(self, key: str) -> CaseRecord | None:
        """Return the record under a key, or None."""
        with self._told():
            row = self._connection.execute("SELECT id FROM cases WHERE key = ?", (key,)).fetchone()
        return None if row is None else self._record(int(row[0]))

    def arrange(self, keys: Iterable[str]) -> "Cases":
        """Make the cases with these keys, in this order, the cases of the run, and return them."""
        with self.writing(), self._told():
            self._connection.execute("UPDATE cases SET place = NULL WHERE place IS NOT NULL")
            self._connection.executemany(
                "UPDATE cases SET place = ? WHERE key = ?",
                ((place, key) for place, key in enumerate(keys)),
            )
        return self.cases()

    def put_places(self, places: Iterable[tuple[str, int]]) -> None:
        """Set the places of the run's cases, by name, in a larger plan with the same order."""
        with self.writing(), self._told():
            self._connection.executemany(
                "UPDATE cases SET place = ? WHERE name = ? AND place IS NOT NULL",
                ((place, _storable(name)) for name, place in places),
            )

    def entries(self) -> Iterator[tuple[int, str, CaseRecord]]:
        """Yield place, key and record of each case of the run; of later additions only the picture."""
        for row in self._ids("SELECT id FROM cases WHERE place IS NOT NULL ORDER BY place"):
            with self._told():
                place, key, record, added = self._connection.execute(
                    "SELECT place, key, record, added FROM cases WHERE id = ?", (row,)
                ).fetchone()
                case = expand_case(_object(_inflated(record)))
                later = _object(added) if added else None
                if later is not None and "picture" in later:
                    case["picture"] = later["picture"]
            if wrong := problem_of_case(case):
                raise DamagedTableError(f"{self.path}: {wrong}")
            yield int(place), str(key), case

    def cases(self) -> "Cases":
        """Return the cases of the run in its order."""
        return Cases(self, self._ids("SELECT id FROM cases WHERE place IS NOT NULL ORDER BY place"))

    def put_document(self, document: str) -> None:
        """Write the run's document without its cases."""
        with self.writing(), self._told():
            self._connection.execute("DELETE FROM run")
            self._connection.execute("INSERT INTO run VALUES (?)", (document,))

    def document(self) -> str | None:
        """Return the run's document without its cases; None if the run has written none."""
        with self._told():
            row = self._connection.execute("SELECT document FROM run").fetchone()
        return None if row is None else str(row[0])

    def amend(self, name: str, fields: CaseRecord) -> None:
        """Override fields in the record of the run's case of this name with those in `fields`."""
        with self._told():
            row = self._connection.execute(
                "SELECT id, added FROM cases WHERE name = ? AND place IS NOT NULL", (_storable(name),)
            ).fetchone()
            if row is None:
                return
            added = {**(json.loads(row[1]) if row[1] else {}), **fields}
            self._connection.execute(
                "UPDATE cases SET added = ?, item = ? WHERE id = ?",
                (as_json(added), _storable(added.get("item")), row[0]),
            )
        held = self._held.get(int(row[0]))
        if held is not None:
            held.update(fields)

    def check(self) -> None:
        """Raise DamagedTableError if the file's pages are inconsistent, or a row contains no valid case."""
        with self._told():
            (word,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if word != "ok":
            raise DamagedTableError(f"{self.path}: is damaged: {' '.join(str(word).split())}")
        for brief in self.cases().briefs():
            if wrong := problem_of_case(brief):
                raise DamagedTableError(f"{self.path}: {wrong}")

    def salvaged(self) -> Iterator[tuple[str, CaseRecord]]:
        """Yield every key and record that can still be read."""
        last, left = 0, GAPS
        while left:
            try:
                for number, key in self._connection.execute(
                    "SELECT id, key FROM cases WHERE id > ? ORDER BY id", (last,)
                ):
                    if number <= last:
                        raise TypeError("goes in a circle")
                    last = number
                    with suppress(OSError, *_DAMAGED):
                        yield str(key), self._record(number)
                return
            except (sqlite3.Error, UnicodeDecodeError, OverflowError, TypeError):
                last, left = last + 1, left - 1  # a page is unreadable; later rows may be readable

    def _ids(self, query: str, values: tuple[Any, ...] = ()) -> "array[int]":
        with self._told():
            return array("q", (int(row[0]) for row in self._connection.execute(query, values)))

    def _record(self, number: int) -> CaseRecord:
        held = self._held.get(number)
        if held is not None:
            return held
        with self._told():
            row = self._connection.execute("SELECT record, added, size FROM cases WHERE id = ?", (number,)).fetchone()
            if row is None:
                raise KeyError(f"case {number} is gone")
            text = _inflated(row[0])
            record = expand_case(_object(text))
            if row[1]:
                record.update(_object(row[1]))
            if wrong := problem_of_case(record):
                raise DamagedTableError(f"{self.path}: {wrong}")
        self._hold(number, record, len(text))
        return record

    def _hold(self, number: int, record: CaseRecord, size: int) -> None:
        """Hold a record in memory if there is room; nothing is evicted, since passes begin at the first record."""
        if number in self._held or size <= self._room:
            self._room -= 0 if number in self._held else size
            self._held[number] = record

    def _forget(self) -> None:
        self._held.clear()
        self._room = HELD

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Convert SQLite's errors to OSError for a full or read-only disk, otherwise to DamagedTableError."""
        try:
            yield
        except DamagedTableError:
            raise
        except sqlite3.DatabaseError as error:
            why = " ".join(str(error).split())
            number = {"SQLITE_FULL": ENOSPC, "SQLITE_READONLY": EROFS, "SQLITE_IOERR": EIO, "SQLITE_CANTOPEN": EIO}
            name = str(getattr(error, "sqlite_errorname", ""))
            code = next((code for prefix, code in number.items() if name.startswith(prefix)), None)
            if code is not None:
                raise OSError(code, why, str(self.path)) from None
            raise DamagedTableError(f"{self.path}: cannot be read: {why}") from None
        except _DAMAGED as error:
            why = " ".join(str(error).split())
            raise DamagedTableError(f"{self.path}: holds a damaged record: {why[:200]}") from None


class Cases(Sequence[CaseRecord]):
    """The records of a table's cases in some order; a record is read when it is accessed."""

    def __init__(self, table: CaseTable, numbers: "array[int]") -> None:
        self.table, self._numbers = table, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, place: int) -> CaseRecord: ...
    @overload
    def __getitem__(self, place: slice) -> list[CaseRecord]: ...
    def __getitem__(self, place: int | slice) -> CaseRecord | list[CaseRecord]:
        if isinstance(place, slice):
            return [self.table._record(number) for number in self._numbers[place]]
        return self.table._record(self._numbers[place])

    def __iter__(self) -> Iterator[CaseRecord]:
        return map(self.table._record, self._numbers)

    def briefs(self) -> Iterator[CaseRecord]:
        """Yield each case's brief, for lists: the record without `HEAVY`, with `worst_ratio` and `wrong_pixels`."""
        query = "SELECT brief, added FROM cases WHERE id = ?"
        for row in self._numbers:
            with self.table._told():
                brief, added = self.table._connection.execute(query, (row,)).fetchone()
                record = _laid_over(brief, added)
            yield record

    def named(self, name: str) -> CaseRecord | None:
        """Return the record of the case with this name, or None."""
        query = "SELECT id FROM cases WHERE name = ? AND place IS NOT NULL"
        numbers = self.table._ids(query, (_storable(name),))
        return self.table._record(numbers[0]) if numbers else None

    def worst_first(self) -> "Cases":
        """Return the run's cases, sorted by verdict, error over limit and name, the worst first."""
        query = (
            "SELECT id FROM cases WHERE place IS NOT NULL ORDER BY badness DESC, coalesce(ratio, 0.0) DESC, name, place"
        )
        return Cases(self.table, self.table._ids(query))

    def by_family(self) -> Iterator[tuple[str, "Cases"]]:
        """Yield each family with its cases, in the order of the families' first cases."""
        query = "SELECT family FROM cases WHERE place IS NOT NULL GROUP BY family ORDER BY min(place)"
        with self.table._told():
            families = [str(row[0]) for row in self.table._connection.execute(query)]
        for family in families:
            query = "SELECT id FROM cases WHERE place IS NOT NULL AND family = ? ORDER BY place"
            yield family, Cases(self.table, self.table._ids(query, (family,)))


def briefs(cases: Sequence[CaseRecord]) -> Iterable[CaseRecord]:
    """Return each case's brief, for lists; for cases in memory the whole record."""
    return cases.briefs() if isinstance(cases, Cases) else cases


def by_family(cases: Sequence[CaseRecord]) -> Iterable[tuple[str, Sequence[CaseRecord]]]:
    """Return each family with its cases, in the order of the families' first cases."""
    if isinstance(cases, Cases):
        return cases.by_family()
    families: dict[str, list[CaseRecord]] = {}
    for case in cases:
        families.setdefault(case["family"], []).append(case)
    return families.items()


def named(cases: Sequence[CaseRecord], name: str) -> CaseRecord | None:
    """Return the whole record of the case with this name, or None."""
    return (
        cases.named(name) if isinstance(cases, Cases) else next((case for case in cases if case["name"] == name), None)
    )


def by_name(cases: Sequence[CaseRecord]) -> Callable[[str], CaseRecord]:
    """Return a function from a case's name to its whole record, which raises KeyError for an unknown name."""
    if not isinstance(cases, Cases):
        return {case["name"]: case for case in cases}.__getitem__

    def read(name: str) -> CaseRecord:
        record = cases.named(name)
        if record is None:
            raise KeyError(name)
        return record

    return read


def amending(cases: Sequence[CaseRecord]) -> AbstractContextManager[None]:
    """Return a context that commits all calls of `amend` together at its end; each commit takes milliseconds."""
    return cases.table.writing() if isinstance(cases, Cases) else nullcontext()


def amend(cases: Sequence[CaseRecord], case: CaseRecord, **fields: Any) -> None:
    """Add fields to a case's record, and to its row if the cases are stored in a table."""
    additions = cast(CaseRecord, fields)
    case.update(additions)
    if isinstance(cases, Cases):
        cases.table.amend(case["name"], additions)


def _storable(value: Any) -> Any:
    return value.encode(errors="replace").decode() if isinstance(value, str) else value


def _object(text: bytes | str) -> CaseRecord:
    """Decode the JSON object of a record, or of additions to a record, without validating it."""
    try:
        record = msgspec.json.decode(text)
    except msgspec.DecodeError:
        record = json.loads(text)  # slower, but accepts lone surrogates, which come from undecodable file names
    if not isinstance(record, dict):
        raise TypeError("is no JSON object")
    return cast(CaseRecord, record)


def _laid_over(record: bytes | str, added: str | None) -> CaseRecord:
    case = _object(record)
    if added:
        case.update(_object(added))
    return case


def _inflated(deflated: Any) -> bytes:
    inflater = zlib.decompressobj()
    text = inflater.decompress(deflated, LARGEST)
    if inflater.unconsumed_tail or not inflater.eof:
        raise ValueError("is cut short, or larger than any record")
    return text
