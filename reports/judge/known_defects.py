"""Known defects of references (findings.json): they turn `reference_suspect` into `warn`.

A finding consists of the renderer's version, the circumstances of its defect, the smallest scene with the defect and a
third reference; findings are data in findings.json in this folder, so that a reviewer sees them in a diff.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from rayproof.cases.placement import placed, world_triangles
from rayproof.cases.scene import Mesh, Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import dot, length
from rayproof.reports.results.records import FindingRecord


@dataclass(frozen=True, kw_only=True)
class KnownFinding:
    """One defect of a reference, with its evidence."""

    name: str
    reference: str
    version: str
    stage: Stage
    where: str  # the circumstance of the defect; "" if the adapter prevents it in every scene
    at_least: float  # threshold of the circumstance's number
    smallest_scene: str  # path of a scene file with the defect, in the repository
    command: str  # to reproduce it
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
        """Return whether its circumstances apply to all pixels of a mask (height, width), which is not empty."""
        if not self.where or not pixels.any():
            return False
        return bool(np.all(CIRCUMSTANCES[self.where](scene, truth, pixels) >= self.at_least))


@lru_cache(maxsize=1)
def known_findings() -> tuple[KnownFinding, ...]:
    """Return the recorded findings, one per stage; raise TypeError if a finding lacks a field."""
    entries = json.loads(Path(__file__).with_name("findings.json").read_text(encoding="utf-8"))
    findings = []
    for entry in entries:
        stages = entry.pop("stages")
        for stage in stages:
            name = entry["name"] if len(stages) == 1 else f"{entry['name']}_{stage}"
            findings.append(KnownFinding(**entry | {"name": name, "stage": Stage(stage)}))
    return tuple(findings)


def explained(
    reference: str, version: str, stage: Stage, scene: Scene, truth: StageImages, pixels: np.ndarray
) -> KnownFinding | None:
    """Return the finding that explains a disagreement at these pixels (height, width), or None."""
    for finding in known_findings():
        same = (finding.reference, finding.version, finding.stage) == (reference, version, stage)
        if same and finding.covers(scene, truth, pixels):
            return finding
    return None


# The circumstances of findings about references: numbers per pixel that depend on the scene.
#
# To add a circumstance: a function (scene, the oracle's answers, pixels) -> (n,) and its line in `CIRCUMSTANCES`. A
# finding has its name and a threshold. The function's docstring derives why the defect grows with the number.


def light_nearness(scene: Scene, truth: StageImages, pixels: np.ndarray) -> np.ndarray:
    """Return the size of the hit's coordinates over its distance from the nearest light, 0 on a miss.

    From 2^22 on the distance is smaller than float32's rounding error of the coordinates, and may be computed as 0.
    """
    position, nearness = truth[Stage.POSITION][pixels], np.zeros(np.count_nonzero(pixels))
    for light in scene.lights:
        place = np.asarray(light.position, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (np.linalg.norm(place) + length(position)) / length(place - position)
        nearness = np.maximum(nearness, np.nan_to_num(near, nan=0.0))
    return np.where(truth[Stage.OBJECT][pixels, 0] >= 0, nearness, 0.0)


def center_over_hit(scene: Scene, truth: StageImages, pixels: np.ndarray) -> np.ndarray:
    """Return (distance of the visible sphere's centre from the origin + radius) / (1 m + the hit's largest coordinate).

    A hit in float32 is off its surface by at most 16 u times the numerator, and Mitsuba's shadow rays start 1500 u
    times the denominator above it. If the ratio is at least 1500 / 16, the sphere may block its own light.
    """
    objects, ratio = truth[Stage.OBJECT][pixels, 0], np.zeros(np.count_nonzero(pixels))
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Sphere):
            linear, shift = placed(shape)
            size = np.linalg.norm(linear @ shape.center + shift) + shape.radius * np.linalg.norm(linear, 2)
            ratio = np.where(objects == index, size / (1 + np.abs(truth[Stage.POSITION][pixels]).max(axis=-1)), ratio)
    return ratio


def edge_nearness(scene: Scene, truth: StageImages, pixels: np.ndarray) -> np.ndarray:
    """Return the length of a pixel's ray, or of one of its shadow rays, over its distance from the nearest mesh edge.

    A program that rounds a shared edge differently for its two faces has a hole there: if only a few roundings of the
    ray's length decide whether a point is inside a polygon, it may be outside of both.
    """
    corners = [world_triangles(shape).astype(np.float64) for shape in scene.shapes if isinstance(shape, Mesh)]
    nearness = np.zeros(np.count_nonzero(pixels))
    if not corners:
        return nearness
    faces = np.concatenate(corners)
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    eye, rays, hits = np.asarray(scene.camera.eye), truth[Stage.RAY][pixels], truth[Stage.POSITION][pixels]
    ways = [(eye, rays)]
    ways += [(np.asarray(light.position), hits - np.asarray(light.position)) for light in scene.lights]
    for start, directions in ways:
        for number, direction in enumerate(directions):
            with np.errstate(divide="ignore", invalid="ignore"):
                unit = direction / length(direction)
                along = (edges - start) @ unit
                off = edges - start - along[..., np.newaxis] * unit
                first, side = off[:, 0], off[:, 1] - off[:, 0]
                share = np.clip(-dot(first, side) / dot(side, side), 0.0, 1.0)
                close = length(first + np.nan_to_num(share)[:, np.newaxis] * side)
                least = np.min(close / np.abs(along).min(axis=1))
                nearness[number] = max(nearness[number], 1 / least if least > 0 else np.inf)
    return nearness


CIRCUMSTANCES: dict[str, Callable[[Scene, StageImages, np.ndarray], np.ndarray]] = {
    "center_over_hit": center_over_hit,
    "edge_nearness": edge_nearness,
    "light_nearness": light_nearness,
}
