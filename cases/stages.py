"""The specification's ordered list of stages: one order for results, blame, file channels and interfaces."""

import math
from dataclasses import dataclass
from enum import StrEnum


class Stage(StrEnum):
    """A quantity of the light path, in the order in which a ray tracer computes them."""

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
    """What a stage's image means: its unit, its value where a ray hits nothing, its OpenEXR channel names.

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
