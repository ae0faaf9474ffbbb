"""`SceneTruth`: the oracle's answers to a scene and their conditioning, which all judging of the scene shares."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import dot, widest_near
from rayproof.reports.judge.forward.conditioning import Conditioning, condition
from rayproof.reports.judge.forward.limits import Limits, limits

SMOOTH = 0.9  # cosine of the angle between neighbours' normals; at a cube's edge it is less


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneTruth:
    """The part of judging that no renderer changes."""

    scene: Scene
    truth: StageImages
    conditioning: Conditioning
    oracle: Analytic

    @cached_property
    def no_limit(self) -> np.ndarray:
        """Return the limit of whole numbers, 0 (height, width)."""
        return np.zeros(self.conditioning.hit.shape)

    @cached_property
    def pixels_per_length(self) -> np.ndarray:
        """Return the largest number of pixels per length [px/m] within two pixels, (height, width)."""
        c = self.conditioning
        with np.errstate(divide="ignore", invalid="ignore"):
            return widest_near(np.where(c.hit, 1 / (c.distance * c.pixel_angle), 0.0))

    @cached_property
    def beside_changes(self) -> np.ndarray:
        """Return the pixels (height, width) with a neighbour that shows another face, other lights or another side."""
        shown = [self.truth[stage] for stage in (Stage.OBJECT, Stage.VISIBILITY) if stage in self.truth]
        image = np.concatenate(shown, axis=-1)
        turned = dot(self.truth[Stage.NORMAL], self.truth[Stage.RAY]) < 0
        beside = np.zeros(self.conditioning.hit.shape, dtype=bool)
        for axis in (0, 1):
            first, second = (_cut(image, axis, side) for side in (slice(None, -1), slice(1, None)))
            changes = (first != second).any(axis=-1)
            lit = (_cut(turned, axis, side) for side in (slice(None, -1), slice(1, None)))
            changes |= next(lit) != next(lit)
            normals = (_cut(self.truth[Stage.NORMAL], axis, side) for side in (slice(None, -1), slice(1, None)))
            changes |= dot(next(normals), next(normals)) < SMOOTH
            for side in (slice(None, -1), slice(1, None)):
                _cut(beside, axis, side)[...] |= changes
        return beside

    @cached_property
    def limits(self) -> Callable[..., Limits]:
        """Return a function of a roundoff and `by_matrices`: the limits of each kind of rounding, computed once."""
        return cache(partial(limits, self.scene, self.truth, self.conditioning))


def _cut(image: np.ndarray, axis: int, part: slice) -> np.ndarray:
    """Return part of the rows (axis 0) or the columns (axis 1) of an image."""
    return image[part] if axis == 0 else image[:, part]


def scene_truth(
    scene: Scene, stages: tuple[Stage, ...], oracle: Analytic, *, known: StageImages | None = None
) -> SceneTruth:
    """Return the truth of a scene; `known` are the oracle's answers if they exist already."""
    truth = known if known is not None and set(stages) <= set(known) else oracle.render(scene, stages)
    return SceneTruth(scene=scene, truth=truth, conditioning=condition(scene, truth), oracle=oracle)
