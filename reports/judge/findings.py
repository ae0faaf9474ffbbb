"""Checked-in findings about references: the only thing that turns `reference_suspect` into `warn`.

A finding names the renderer's version, the smallest scene that shows its defect and a third witness; it is data, in
findings.json beside this file, so that a reviewer sees it in the diff.
"""

import fnmatch
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from cases.stages import Stage


@dataclass(frozen=True, kw_only=True)
class KnownFinding:
    """One defect of a reference, with its evidence."""

    name: str
    reference: str
    version: str
    stage: Stage
    cases: str  # glob over the names of the cases that it explains; "" where the adapter keeps it out of every case
    smallest_scene: str  # the scene file that shows it, in the repository
    command: str  # that shows it
    third_witness: str
    what: str


@lru_cache(maxsize=1)
def known_findings() -> tuple[KnownFinding, ...]:
    """Return the checked-in findings; raise TypeError if one lacks a field."""
    entries = json.loads(Path(__file__).with_name("findings.json").read_text(encoding="utf-8"))
    return tuple(KnownFinding(**entry | {"stage": Stage(entry["stage"])}) for entry in entries)


def explained(reference: str, version: str, stage: Stage, case: str) -> KnownFinding | None:
    """Return the finding that explains a disagreement, or None."""
    for finding in known_findings():
        same = (finding.reference, finding.version, finding.stage) == (reference, version, stage)
        if same and fnmatch.fnmatchcase(case, finding.cases):
            return finding
    return None
