"""What a sentinel is, the scene that most of them stand in, and how answers are spoiled."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Sphere
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.renderers import Witness
from rayproof.reports.results.outcomes import Outcome

SCENE = Scene(
    camera=Camera(
        eye=(3.1, -4.2, 2.6),
        target=(0.1, 0.2, 0.0),
        up=(0.1, 0.2, 1.0),
        fovy=34.0,
        width=24,
        height=18,
        near=0.1,
        far=60.0,
    ),
    shapes=(
        Sphere(albedo=(0.7, 0.5, 0.3), center=(0.3, -0.2, 0.3), radius=0.9),
        Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0.3), (0, 1, 0, 0.1), (0, 0, 1, -0.8), (0, 0, 0, 1))),
        Cube(albedo=(0.9, 0.2, 0.4), to_world=((0.8, -0.6, 0, 1.6), (0.6, 0.8, 0, 0.9), (0, 0, 1, -0.3), (0, 0, 0, 1))),
    ),
    lights=(PointLight(position=(1.7, -1.1, 4.2), flux=(90.0, 70.0, 50.0)),),
)
CASE = Case(
    name="sentinel/judge",
    scene=SCENE,
    stresses="Nothing: its answers are spoiled on purpose.",
    covers=("HIT-1",),
    least_interior=200,
    most_edge=0.05,
)


class BrokenJudgeError(RuntimeError):
    """The judge got a sentinel wrong: nothing that it says can be believed."""


@dataclass(frozen=True, kw_only=True)
class Sentinel:
    """Answers with a known verdict."""

    name: str
    ours: StageImages | None
    theirs: StageImages
    outcome: Outcome
    stage: Stage | None  # the one blamed; None: any
    case: Case = CASE
    others: tuple[Witness, ...] = ()  # who is heard beside the oracle
    steps: Mapping[Stage, Resolution] = field(default_factory=dict)  # how coarse the candidate's output is


def rounded(answers: StageImages) -> StageImages:
    """Return answers as a faultless float32 renderer gives them."""
    return {
        stage: image if stage is Stage.CAMERA else np.asarray(image).astype(np.float32).astype(np.float64)
        for stage, image in answers.items()
    }


def spoilt_at(image: np.ndarray, pixel: tuple[int, int], value: float) -> np.ndarray:
    """Return a copy of an image with the first channel of one pixel replaced."""
    changed = image.copy()
    changed[(*pixel, 0)] = value
    return changed
