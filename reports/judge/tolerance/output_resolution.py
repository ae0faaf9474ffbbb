"""What a coarse output costs: a program whose files resolve less than its arithmetic is judged by its files' steps.

A step moves a stage's own value, end to end and continued alike. What a coarse stage hands down counts only where the
oracle continues from it: the program itself went on from the number that it had before writing it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.tolerance.channels import length
from rayproof.reports.judge.tolerance.conditioning import Conditioning

VECTORS = (Stage.RAY, Stage.POSITION, Stage.NORMAL)
# Whole numbers are themselves in any format: a step says nothing about them.
WHOLE = (Stage.OBJECT, Stage.VISIBILITY)
# An output of fewer levels than a byte's is no measurement of what it shows.
COARSEST = 1 / 256


@dataclass(frozen=True, kw_only=True)
class Coarseness:
    """A party's steps; nothing where it declared none."""

    resolutions: Mapping[Stage, Resolution]

    def step(self, stage: Stage, value: np.ndarray) -> np.ndarray | float:
        """Return how far the output's step may move `value` (height, width, channels), in the measure of errors.

        Vectors, as a whole, and distances give (height, width); light gives (height, width, channels). What is not
        finite has no step: a miss is a miss in any format.
        """
        one = self.resolutions.get(stage)
        if one is None or stage in WHOLE:
            return 0.0
        if stage in VECTORS:
            size, steps = length(np.asarray(value)), math.sqrt(3.0)
        else:
            size, steps = np.abs(value[..., 0] if stage is Stage.DISTANCE else value), 1.0
        finite = np.isfinite(size)
        return np.where(finite, one.relative * np.where(finite, size, 0.0) + steps * one.absolute, 0.0)

    def handed_down(self, scene: Scene, stage: Stage, given: StageImages, c: Conditioning) -> np.ndarray | float:
        """Return how far the steps of `given` stages may move what the oracle continues from them.

        By the derivatives that the limits use: a ray turned slides its hit, a point moved along a curved surface turns
        its normal and changes cos / r^2, and so on.
        """
        if not self.resolutions:
            return 0.0

        def moved(before: Stage) -> np.ndarray | float:
            return self.step(before, given[before]) if before in given else 0.0

        if stage is Stage.DISTANCE:
            return moved(Stage.RAY) * c.swing
        if stage is Stage.POSITION:
            return moved(Stage.RAY) * c.distance + moved(Stage.DISTANCE)
        if stage is Stage.NORMAL:
            return c.turned(moved(Stage.POSITION))
        if stage is Stage.IRRADIANCE:
            moved_and_turned = (self.step(before, given[before]) for before in (Stage.POSITION, Stage.NORMAL))
            return irradiance_moved(scene, given, *moved_and_turned)
        if stage is Stage.EXITANCE:
            # No albedo is above its own largest: one bound for the image.
            return max((max(shape.albedo) for shape in scene.shapes), default=0.0) * moved(Stage.IRRADIANCE)
        if stage is Stage.RADIANCE:
            return moved(Stage.EXITANCE) * (1.0 if scene.shading == "simplified" else 1 / math.pi)
        return 0.0

    def because(self, stage: Stage, name: str) -> str:
        """Return the part of a limit's derivation that is this party's output, or nothing."""
        one = self.resolutions.get(stage)
        if one is None or stage in WHOLE:
            return ""
        return f"; {name}'s output resolves {one.relative:.3g} of the value plus {one.absolute:.3g}: {one.because}"

    def too_coarse(self, stage: Stage, truth: np.ndarray) -> str | None:
        """Say why an output says nothing about a stage of which `truth` is the answer, or None."""
        one = self.resolutions.get(stage)
        if one is None or stage in WHOLE:
            return None
        finite = np.abs(truth[np.isfinite(truth)])
        largest = float(finite.max(initial=0.0))
        if largest > 0 and not one.relative + one.absolute / largest <= COARSEST:
            step = one.relative * largest + one.absolute
            return f"its output's steps of {step:.3g} ({one.because}) tell nothing of values up to {largest:.3g}"
        return None


def irradiance_moved(
    scene: Scene, given: StageImages, moved: np.ndarray | float, turned: np.ndarray | float
) -> np.ndarray:
    """Return what positions `moved` [m] and normals `turned` [rad] do to irradiance (height, width, 3), where lit."""
    inverse_square = scene.shading == "inverse_square"
    total = np.zeros((*given[Stage.POSITION].shape[:2], 3))
    for index, light in enumerate(scene.lights):
        r = length(np.asarray(light.position, dtype=np.float64) - given[Stage.POSITION])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            relative = (3 if inverse_square else 1) * moved / r + turned
            scale = relative / (4 * math.pi * r**2) if inverse_square else relative
            arriving = np.asarray(light.flux) * given[Stage.VISIBILITY][..., index : index + 1]
            moves = arriving * np.asarray(scale)[..., np.newaxis]
        total += np.nan_to_num(moves, nan=0.0, posinf=0.0)
    return total
