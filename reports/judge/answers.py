"""`Answers`: a renderer's answers to a case; missing and misshapen images; small array functions of the judge."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages, exr_channels
from rayproof.reports.results.outcomes import Outcome


@dataclass(frozen=True, kw_only=True)
class Answers:
    """The answers of a renderer, subject or reference, to a case, or its error."""

    name: str
    precision: str
    answers: StageImages = field(default_factory=dict)  # empty if there is an error
    items: frozenset[str] = frozenset()  # of a subject: specification items whose formulas it ran
    independent: bool = False  # of a reference: it shares neither code nor Dr.Jit's compiler with the tracer
    error: str | None = None
    stopped: bool = False  # the error is that it overran its time limit
    lost: bool = False  # the error is that a program that stays alive died or exceeded a limit
    unsupported: Mapping[Stage, str] = field(default_factory=dict)  # stages that it declares unsupported, with reasons
    lacking: Mapping[Stage, str] = field(default_factory=dict)  # stages without a required answer, with reasons
    fine: StageImages | None = None  # the tracer's answers at the resolution of a case's samples
    mean: np.ndarray | None = None  # (height, width, 3): radiance box-filtered by the renderer, in place of `fine`
    # (height, width, 3): for a program that draws random numbers, the error bound of the mean of its radiance over all
    # smooth pixels, equal in each of them; NaN in other pixels
    pooled_error: np.ndarray | None = None
    resolutions: Mapping[Stage, Resolution] = field(default_factory=dict)  # of outputs that are coarser than float32
    # m, a scalar or per pixel: how far it declares to move a shadow ray's start or to ignore blockers near it
    shadow_epsilon: float | np.ndarray = 0.0
    ray_epsilon: float = 0.0  # m: it ignores hits nearer to a ray's origin than this
    light_epsilon: float = 0.0  # of a shadow ray's length: it ignores blockers nearer to the light than this
    edge_epsilon: float = 0.0  # m: points no farther beyond an edge than this may count as inside
    sample_radius: float = 0.0  # px: largest distance of its rays from the camera's `sample_offset`
    tie_epsilon: float = 0.0  # m: it may name either of two surfaces no farther apart along a ray than this
    chained: bool = True  # each stage was computed from the numbers of the stages before it, not in a separate pass
    world_normals: bool = False  # of a program: it computes faces' normals from float32 corners in world space
    notes: tuple[str, ...] = ()  # sentences about answers to a different problem than the requested one
    mishaps: tuple[str, ...] = ()  # sentences about problems in obtaining its answers, without a loss
    settings: Mapping[str, str] = field(default_factory=dict)  # settings that its answers depend on, for the report
    cached: bool = False  # its images are cached from an earlier run

    @property
    def by_matrices(self) -> bool:
        """Return whether its rays are computed by the inverse matrices (CAM-5)."""
        return "CAM-5" in self.items

    def answers_at(self, stage: Stage) -> bool:
        """Return whether it must answer this stage: every stage that it did not declare unsupported."""
        return stage not in self.unsupported


LOST = "it was announced and nothing came of it"


def lost(panel: Collection[str], references: Collection[Answers]) -> list[Answers]:
    """Return an answer with the error `LOST` for each planned reference of `panel` without a reply."""
    present = {reference.name for reference in references}
    return [Answers(name=name, precision="float32", error=LOST) for name in panel if name not in present]


def abstention(reference: Answers) -> Outcome:
    """Return the outcome of checks against a reference without an answer: it does not vote, or was lost."""
    return Outcome.MISSING if reference.error == LOST else Outcome.UNDECIDED


# Images of the wrong size or with wrong channels, detected before any comparison, so that nothing is broadcast.


def misshapen(scene: Scene, answers: StageImages) -> dict[Stage, str]:
    """Return a reason for each image stage whose size is not the camera's."""
    size, lights = (scene.camera.height, scene.camera.width), len(scene.lights)
    right = {stage: (*size, len(exr_channels(stage, lights=lights))) for stage in IMAGE_STAGES}
    return {
        stage: f"{stage} has shape {np.shape(image)}, not {right[stage]}"
        for stage, image in answers.items()
        if stage in right and np.shape(image) != right[stage]
    }


def without(renderer: Answers, stages: Collection[Stage]) -> Answers:
    """Return the renderer without its answers to the given stages."""
    if renderer.error is not None or not stages:
        return renderer
    return replace(renderer, answers={stage: image for stage, image in renderer.answers.items() if stage not in stages})


def well_shaped(scene: Scene, renderer: Answers) -> Answers:
    """Return the renderer without misshapen images."""
    return without(renderer, misshapen(scene, renderer.answers))


# Images (..., channels) reduced over their channels one by one, since NumPy takes ten times as long over a short axis.
#
# Sums run from the first channel to the last, as NumPy's do, so that the bits are the same.


def _reduced(operation: Callable[[np.ndarray, np.ndarray], np.ndarray], image: np.ndarray) -> np.ndarray:
    return reduce(operation, (image[..., channel] for channel in range(image.shape[-1])))


def any_of(image: np.ndarray) -> np.ndarray:
    """Return a mask (...): any channel is true; False without channels."""
    return _reduced(np.logical_or, image) if image.shape[-1] else np.zeros(image.shape[:-1], dtype=bool)


def all_of(image: np.ndarray) -> np.ndarray:
    """Return a mask (...): all channels are true."""
    return _reduced(np.logical_and, image) if image.shape[-1] else np.ones(image.shape[:-1], dtype=bool)


def largest(image: np.ndarray) -> np.ndarray:
    """Return the largest channel (...); NaN if any is NaN."""
    return _reduced(np.maximum, image)


def dot(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return dot products (...) of vectors."""
    # NumPy's sums begin at +0, so that negative zeros add up to +0, which atan2 distinguishes from -0.
    return _reduced(np.add, left * right) + 0.0


def length(vectors: np.ndarray) -> np.ndarray:
    """Return Euclidean lengths (...)."""
    return np.sqrt(dot(vectors, vectors))


def crossed(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of cross products."""
    x, y, z = (left[..., channel] for channel in range(3))
    u, v, w = (right[..., channel] for channel in range(3))
    across, down, along = y * w - z * v, z * u - x * w, x * v - y * u
    return np.sqrt(across * across + down * down + along * along)


def widest_near(image: np.ndarray) -> np.ndarray:
    """Return each pixel's largest value within two pixels, (height, width)."""
    return _widest_of_five(_widest_of_five(image, axis=0), axis=1)


def _widest_of_five(image: np.ndarray, *, axis: int) -> np.ndarray:
    """Return each pixel's largest value within two pixels along one axis."""
    length = image.shape[axis]
    padded = np.take(image, np.clip(np.arange(-2, length + 2), 0, length - 1), axis=axis)
    near = [padded[first : first + length] if axis == 0 else padded[:, first : first + length] for first in range(5)]
    widest = near[0]
    for shifted in near[1:]:
        widest = np.maximum(widest, shifted)
    return widest
