"""The journal: one line per finished case, written as it finishes, so that a killed run loses nothing.

Records are deflated, and once results.json holds them the journal of a finished run only names them: two copies of
every number would be a third of a results folder.
"""

import base64
import json
import os
import zlib
from collections.abc import Collection
from pathlib import Path

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.document import ResultsError, load_results
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord

NAME = "journal.jsonl"


class Journal:
    """Append finished cases to DIR/journal.jsonl, and read back those whose key still holds."""

    def __init__(self, folder: Path, *, resume: bool) -> None:
        self.path = folder / NAME
        self._done = self._read() if resume else {}
        # What was read is written anew: a line that a kill cut short must not swallow the next one.
        temporary = self.path.with_suffix(".tmp")
        with temporary.open("w", encoding="utf-8") as file:
            for key, record in self._done.items():
                file.write(_line(key, record))
        temporary.replace(self.path)
        self._file = self.path.open("a", encoding="utf-8")

    def _read(self) -> dict[str, CaseRecord]:
        found: dict[str, CaseRecord] = {}
        if not self.path.is_file():
            return found
        settled = _settled(self.path.parent)
        for line in self.path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                entry = json.loads(line)
                if "record" not in entry:
                    found[entry["key"]] = settled[entry["key"]]
                    continue
                found[entry["key"]] = json.loads(zlib.decompress(base64.b64decode(entry["record"])))
            except (ValueError, KeyError, TypeError, zlib.error):
                continue  # the last line of a killed run; its case is simply done again
        return found

    def finished(self, key: str) -> CaseRecord | None:
        """Return the record of a case that was finished under exactly this key, or None.

        An error, or a reference that abstained, may have been the machine's or the time limit's fault, so that such a
        case is done again.
        """
        record = self._done.get(key)
        again = record is None or record.get("verdict") == Outcome.ERROR or bool(record.get("abstained"))
        return None if again else record

    def append(self, key: str, record: CaseRecord) -> None:
        """Write one finished case and make sure that it reached the disk."""
        self._file.write(_line(key, record))
        self._file.flush()
        os.fsync(self._file.fileno())

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def settle(folder: Path, held: Collection[str]) -> None:
    """Leave of a finished run's journal keys and names where results.json holds the records of those keys."""
    path = folder / NAME
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        if entry["key"] in held:
            entry.pop("record", None)
        lines.append(json.dumps(entry) + "\n")
    write_text(path, "".join(lines))


def _settled(folder: Path) -> dict[str, CaseRecord]:
    """Return results.json's records by the key under which they were found; without the file cases are done again."""
    try:
        return {case["key"]: case for case in load_results(folder)["cases"] if isinstance(case.get("key"), str)}
    except (ResultsError, OSError):
        return {}


def _line(key: str, record: CaseRecord) -> str:
    packed = base64.b64encode(zlib.compress(json.dumps(record).encode())).decode("ascii")
    return (
        json.dumps({"key": key, "name": record.get("name"), "verdict": record.get("verdict"), "record": packed}) + "\n"
    )
