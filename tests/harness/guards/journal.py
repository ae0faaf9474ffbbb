"""The journal's guard: a finished case is taken up again under exactly its own key, and only when that is asked for."""

import tempfile
from pathlib import Path

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.workload import Journal
from tests.harness.guards import BrokenHarnessError

KEY, OTHER = "0" * 64, "1" * 64
RECORD: CaseRecord = {"name": "guard/journal", "family": "guard", "verdict": "pass", "checks": []}


def guard_journal() -> None:
    """Write one record, ask for it by the right key and by a wrong one; raise BrokenHarnessError for a wrong answer."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Journal(folder, resume=False) as journal:
            journal.append(KEY, RECORD)
        with Journal(folder, resume=True) as journal:
            if journal.finished(KEY) != RECORD:
                raise BrokenHarnessError("the journal is broken: a finished case was forgotten")
            if journal.finished(OTHER) is not None:
                raise BrokenHarnessError("the journal is broken: a case was taken up again under another key")
        with Journal(folder, resume=False) as journal:
            if journal.finished(KEY) is not None:
                raise BrokenHarnessError("the journal is broken: a case was taken up again without being asked to")
