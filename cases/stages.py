"""`Stage`, the facts and order of all stages, and `Reference`, the contract of independent renderers.

The order is that of results, blame, file channels and interfaces. The answer of a renderer, `StageImages`, is a
dictionary from stage to array. Image stages are float64 arrays of shape (height, width, channels) with row 0 at the
top, whatever precision computed them; `visibility` has one channel per light (none without lights); `object` holds
(shape index, face index). `Stage.CAMERA` is no image; its answer is a dictionary:

    view, view_inverse               (4, 4)   world -> camera [m] and back
    projection, projection_inverse   (4, 4)   camera -> clip and back
    frustum_corners                  (8, 3)   world [m]; near plane first, then far; in each (sx, sy) =
                                              (-1, -1), (1, -1), (1, 1), (-1, 1)
    ndc                              (height, width, 2)   (sx, sy) of each pixel centre
    pixel                            (height, width, 2)   (px, py) taken back from `ndc`

The camera space of `view` has x right, y up and z forward (depth along F), so that w = depth in clip space.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from rayproof.cases.scene import Scene


class Stage(StrEnum):
    """A quantity of the light path, in the order of their computation."""

    CAMERA = "camera"
    RAY = "ray"
    OBJECT = "object"
    DISTANCE = "distance"
    POSITION = "position"
    NORMAL = "normal"
    VISIBILITY = "visibility"
    IRRADIANCE = "irradiance"
    EXITANCE = "exitance"
    RADIANCE = "radiance"


@dataclass(frozen=True, kw_only=True)
class StageFacts:
    """The meaning of a stage's image: its unit, its value on a miss, its OpenEXR channel names.

    The channel names of `visibility` depend on the number of lights; ask `exr_channels`.
    """

    meaning: str
    unit: str
    miss: float | None  # None: the stage is defined on a miss too
    channels: tuple[str, ...]


FACTS: dict[Stage, StageFacts] = {
    Stage.CAMERA: StageFacts(
        meaning="view, projection, their inverses, frustum corners, pixel <-> NDC", unit="", miss=None, channels=()
    ),
    Stage.RAY: StageFacts(
        meaning="unit direction of the camera ray", unit="1", miss=None, channels=("ray.X", "ray.Y", "ray.Z")
    ),
    Stage.OBJECT: StageFacts(
        meaning="index into shapes, and face index", unit="index", miss=-1.0, channels=("object.V", "face.V")
    ),
    Stage.DISTANCE: StageFacts(
        meaning="distance along the unit direction", unit="m", miss=math.inf, channels=("distance.V",)
    ),
    Stage.POSITION: StageFacts(
        meaning="world point of the hit", unit="m", miss=0.0, channels=("position.X", "position.Y", "position.Z")
    ),
    Stage.NORMAL: StageFacts(
        meaning="unit shading normal", unit="1", miss=0.0, channels=("normal.X", "normal.Y", "normal.Z")
    ),
    Stage.VISIBILITY: StageFacts(
        meaning="1 per light that is above the horizon and unobstructed", unit="1", miss=0.0, channels=()
    ),
    Stage.IRRADIANCE: StageFacts(
        meaning="E, the sum over lights",
        unit="W/m^2",
        miss=0.0,
        channels=("irradiance.R", "irradiance.G", "irradiance.B"),
    ),
    Stage.EXITANCE: StageFacts(
        meaning="M = albedo E", unit="W/m^2", miss=0.0, channels=("exitance.R", "exitance.G", "exitance.B")
    ),
    Stage.RADIANCE: StageFacts(meaning="L towards the camera", unit="W/(m^2 sr)", miss=0.0, channels=("R", "G", "B")),
}

IMAGE_STAGES: tuple[Stage, ...] = tuple(stage for stage in Stage if stage is not Stage.CAMERA)


def exr_channels(stage: Stage, *, lights: int) -> tuple[str, ...]:
    """Return the OpenEXR channel names of an image stage, in the order of the image's last axis."""
    if stage is Stage.VISIBILITY:
        return tuple(f"visibility.{index}" for index in range(lights))
    return FACTS[stage].channels


def upto(last: Stage) -> tuple[Stage, ...]:
    """Return the stages from the first to `last`, in order."""
    stages = tuple(Stage)
    return stages[: stages.index(last) + 1]


StageImages = dict[Stage, Any]


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """How finely a program's output resolves a stage, where that is coarser than its arithmetic."""

    relative: float  # of the value
    absolute: float  # in the stage's unit: half a step of a 16-bit format, or the like
    because: str  # which format or setting, in words
    # The step of each value, in the image's shape, for a format whose step varies; `absolute` is the largest.
    steps: np.ndarray | None = field(default=None, repr=False, compare=False)

    def step(self, values: np.ndarray) -> np.ndarray:
        """Return the largest error of each of `values` (height, width, channels) due to the output's steps."""
        if self.steps is not None and self.steps.shape == values.shape:
            return self.steps
        return self.relative * np.abs(values) + self.absolute


class Reference(Protocol):
    """An independent renderer. Its class docstring states the accuracy of its answers."""

    # One word for its arithmetic ("float64", "float32"): limits are built from it.
    precision: str

    def version(self) -> str:
        """Return program and version, for the report."""
        ...

    def unsupported(self, scene: "Scene", stage: Stage) -> str | None:
        """Return a sentence with the reason why it cannot answer here, or None if it can."""
        ...

    def render(self, scene: "Scene", stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        The points are the centres of a regular subdivision of the pixel.
        """
        ...
