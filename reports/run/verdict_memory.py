"""A run's memory: which verdicts were found before of the very same answers, under the run's own demands."""

import subprocess
import uuid
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.reports.cache import judgements
from rayproof.reports.cache.store import Store
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.demands import Demands


class Memory:
    """What was judged before, for one subject before one panel."""

    def __init__(self, store: Store, demands: Demands) -> None:
        self._store, self._demands = store, demands

    @cached_property
    def _versions(self) -> Mapping[str, str]:
        """Return the version of every reference that would be asked."""
        return {name: version(name) for name in self._demands.references}

    def prepare(self) -> None:
        """Ask the references for their versions, once: while the first renders are on their way it costs nothing."""
        _ = self._versions

    def key(self, case: Case, candidates: Sequence[Candidate], notes: Sequence[str]) -> str:
        """Return the question that a case is, given what the subject answered and said of it."""
        return judgements.judgement_key(case, candidates, self._versions, self._demands, notes).digest

    def recall(self, key: str, folder: Path) -> CaseRecord | None:
        """Return the record found before, its files written into the results folder, or None."""
        found = judgements.recall(self._store, key)
        if found is None:
            return None
        found.write(folder)
        return found.record

    def keep(self, key: str, folder: Path, record: CaseRecord) -> None:
        """Keep a record with its files."""
        judgements.keep(self._store, key, folder, record)


def version(reference: str) -> str:
    """Return a reference's version; one that cannot tell it is never the same twice, and its worker says why."""
    from rayproof.reference import REFERENCES

    try:
        return REFERENCES[reference]().version()
    except (ImportError, OSError, RuntimeError, subprocess.SubprocessError):
        return f"not told, {uuid.uuid4()}"
