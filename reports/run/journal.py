"""The journal: each finished case in results.sqlite, written as it finishes, so that a killed run loses none."""

import base64
import json
import sqlite3
import zlib
from collections.abc import Iterable
from contextlib import AbstractContextManager, suppress
from pathlib import Path

from rayproof.reports.results.atomic import replacing
from rayproof.reports.results.case_table import NAME, Cases, CaseTable, DamagedTableError
from rayproof.reports.results.document import ResultsError, load_results
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord

EARLIER = "journal.jsonl"  # of folders from before November 2026


class Journal:
    """Keep finished cases in DIR/results.sqlite, and give back those whose key still holds."""

    def __init__(self, folder: Path, *, resume: bool) -> None:
        path = folder / NAME
        if not resume:
            for name in (NAME, f"{NAME}-journal", EARLIER):
                (folder / name).unlink(missing_ok=True)
        elif (folder / EARLIER).is_file() and not path.is_file():
            _write(path, _earlier(folder / EARLIER))
        else:
            _mend(path)
        self._table, self._handed_over = CaseTable(path), False
        self._table.begin()

    def finished(self, key: str) -> CaseRecord | None:
        """Return the record of a case that was finished under exactly this key, or None.

        An error, or a reference that abstained, may have been the machine's or the time limit's fault, so that such a
        case is done again.
        """
        try:
            record = self._table.finished(key)
        except DamagedTableError:
            return None  # its case is simply done again
        again = record is None or record.get("verdict") == Outcome.ERROR or bool(record.get("abstained"))
        return None if again else record

    def append(self, key: str, record: CaseRecord) -> None:
        """Write one finished case and make sure that it reached the disk."""
        self._table.keep(key, record)

    def together(self) -> AbstractContextManager[None]:
        """Keep what is appended in the body all at once: as sure as one by one, and quicker."""
        return self._table.writing()

    def cases(self, keys: Iterable[str]) -> Cases:
        """Return the cases under these keys as those of the run, in this order; of keys that are missing there is none.

        They are read from the file, which stays open as long as they are there.
        """
        self._handed_over = True
        return self._table.arrange(keys)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        if not self._handed_over:
            self._table.close()


def _mend(path: Path) -> None:
    """Write a damaged file anew with what can still be read of it."""
    if not path.is_file():
        return
    waiting = Path(f"{path}-journal")  # which must not meet the new file
    try:
        table = CaseTable(path)
    except DamagedTableError:
        path.unlink()
        waiting.unlink(missing_ok=True)
        return
    try:
        table.check()
    except DamagedTableError:
        waiting.unlink(missing_ok=True)
        _write(path, table.salvaged())
    finally:
        table.close()


def _write(path: Path, entries: Iterable[tuple[str, CaseRecord]]) -> None:
    with replacing(path) as draft:
        table = CaseTable(draft)
        try:
            with table.writing():
                for key, record in entries:
                    table.keep(key, record)
        finally:
            table.close()
            Path(f"{draft}-journal").unlink(missing_ok=True)


def _earlier(path: Path) -> Iterable[tuple[str, CaseRecord]]:
    """Yield what a journal of lines holds, each with its record or, once the run was finished, results.json's."""
    settled = _settled(path.parent)
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            # The last line of a killed run may be cut short; its case is simply done again.
            with suppress(ValueError, KeyError, TypeError, zlib.error, sqlite3.Error):
                entry = json.loads(line)
                packed = entry.get("record")
                known = None if packed is None else json.loads(zlib.decompress(base64.b64decode(packed)))
                yield str(entry["key"]), settled[entry["key"]] if known is None else known


def _settled(folder: Path) -> dict[str, CaseRecord]:
    """Return results.json's records by the key under which they were found; without the file cases are done again."""
    try:
        return {case["key"]: case for case in load_results(folder)["cases"] if isinstance(case.get("key"), str)}
    except (ResultsError, OSError):
        return {}
