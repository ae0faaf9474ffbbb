"""Checked-in findings about references: the only thing that turns `reference_suspect` into `warn`.

A finding names the renderer's version, the circumstances under which its defect shows, the smallest scene that shows it
and a third witness; it is data, in findings.json beside this file, so that a reviewer sees it in the diff.
"""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.panel.circumstances import CIRCUMSTANCES
from rayproof.reports.results.records import FindingRecord


@dataclass(frozen=True, kw_only=True)
class KnownFinding:
    """One defect of a reference, with its evidence."""

    name: str
    reference: str
    version: str
    stage: Stage
    where: str  # the circumstance under which it shows; "" where the adapter keeps it out of every scene
    at_least: float  # from how much of it on
    smallest_scene: str  # the scene file that shows it, in the repository
    command: str  # that shows it
    third_witness: str
    what: str

    def as_json(self) -> FindingRecord:
        """Return plain JSON data."""
        return {
            "name": self.name,
            "reference": self.reference,
            "version": self.version,
            "stage": self.stage.value,
            "where": self.where,
            "at_least": self.at_least,
            "smallest_scene": self.smallest_scene,
            "command": self.command,
            "third_witness": self.third_witness,
            "what": self.what,
        }

    def covers(self, scene: Scene, truth: StageImages, pixels: np.ndarray) -> bool:
        """Say whether every one of the pixels (height, width), of which there are some, is under its circumstances."""
        if not self.where or not pixels.any():
            return False
        return bool(np.all(CIRCUMSTANCES[self.where](scene, truth)[pixels] >= self.at_least))


@lru_cache(maxsize=1)
def known_findings() -> tuple[KnownFinding, ...]:
    """Return the checked-in findings, one a stage; raise TypeError if one lacks a field."""
    entries = json.loads(Path(__file__).with_name("findings.json").read_text(encoding="utf-8"))
    found = []
    for entry in entries:
        stages = entry.pop("stages")
        for stage in stages:
            name = entry["name"] if len(stages) == 1 else f"{entry['name']}_{stage}"
            found.append(KnownFinding(**entry | {"name": name, "stage": Stage(stage)}))
    return tuple(found)


def explained(
    reference: str, version: str, stage: Stage, scene: Scene, truth: StageImages, pixels: np.ndarray
) -> KnownFinding | None:
    """Return the finding that explains a disagreement at these pixels (height, width), or None."""
    for finding in known_findings():
        same = (finding.reference, finding.version, finding.stage) == (reference, version, stage)
        if same and finding.covers(scene, truth, pixels):
            return finding
    return None
