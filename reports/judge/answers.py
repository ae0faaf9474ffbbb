"""`Answers`: what a renderer answered to a case; missing and misshapen images; small array helpers of the judge."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages, exr_channels
from rayproof.reports.results.outcomes import Outcome


@dataclass(frozen=True, kw_only=True)
class Answers:
    """The answers of a renderer, subject or reference, to a case, or the error in which it ended."""

    name: str
    precision: str
    answers: StageImages = field(default_factory=dict)  # none where there is an error
    items: frozenset[str] = frozenset()  # of one under test: specification items whose formulas it ran
    independent: bool = False  # of a reference: it shares neither code nor Dr.Jit's compiler with the tracer
    error: str | None = None
    stopped: bool = False  # the error is that its time was over
    lost: bool = False  # the error is that a program that stays alive died or exceeded a limit
    unsupported: Mapping[Stage, str] = field(default_factory=dict)  # stages that it declares it cannot answer, and why
    lacking: Mapping[Stage, str] = field(default_factory=dict)  # stages that it ought to have answered, and what lacks
    fine: StageImages | None = None  # at the resolution of a case's samples: the tracer's own answers there
    mean: np.ndarray | None = None  # (height, width, 3): radiance box-filtered by its own means, instead of `fine`
    # (height, width, 3): of a program that draws random numbers, what the mean of its radiance over all smooth pixels
    # may be off by, in each of them the same; NaN in other pixels
    pooled_error: np.ndarray | None = None
    resolutions: Mapping[Stage, Resolution] = field(default_factory=dict)  # where its output is coarser than float32
    # m, one for all or per pixel: how far it admits to move or ignore things at a shadow ray's start
    shadow_epsilon: float | np.ndarray = 0.0
    ray_epsilon: float = 0.0  # m: hits nearer to a ray's origin than this it does not see
    light_epsilon: float = 0.0  # of a shadow ray's length: blockers nearer to the light than this it does not see
    edge_epsilon: float = 0.0  # m: so far beyond an edge it may take points for inside
    sample_radius: float = 0.0  # px: so far from the camera's `sample_offset` its rays may pass
    tie_epsilon: float = 0.0  # m: of surfaces no farther apart along a ray it may name either
    chained: bool = True  # each stage was computed from the very numbers handed over, not by a pass of its own
    world_normals: bool = False  # of a program: it takes faces' normals from float32 corners in world space
    notes: tuple[str, ...] = ()  # where it answers another question than the one asked, in sentences
    mishaps: tuple[str, ...] = ()  # what went wrong on the way of its answers, none of which was lost, in sentences
    settings: Mapping[str, str] = field(default_factory=dict)  # what its answer depends on, for the report
    cached: bool = False  # its images are those of an earlier run, kept by content

    @property
    def by_matrices(self) -> bool:
        """Say whether its rays come by the inverse matrices (CAM-5)."""
        return "CAM-5" in self.items

    def answers_at(self, stage: Stage) -> bool:
        """Say whether it is asked about this stage: everything that it did not declare unsupported."""
        return stage not in self.unsupported


LOST = "it was announced and nothing came of it"


def lost(panel: Collection[str], references: Collection[Answers]) -> list[Answers]:
    """Return those of an announced panel of whom nothing came: they were planned, and are missing."""
    heard = {reference.name for reference in references}
    return [Answers(name=name, precision="float32", error=LOST) for name in panel if name not in heard]


def abstention(reference: Answers) -> Outcome:
    """Return what becomes of checks against a reference of which there is no answer: it has no say, or was lost."""
    return Outcome.MISSING if reference.error == LOST else Outcome.UNDECIDED


# Images of the wrong size, or with other channels: found before anything is compared, so that nothing is broadcast.


def misshapen(scene: Scene, answers: StageImages) -> dict[Stage, str]:
    """Return a reason for each image stage of another size than the camera's; nothing is ever broadcast."""
    size, lights = (scene.camera.height, scene.camera.width), len(scene.lights)
    right = {stage: (*size, len(exr_channels(stage, lights=lights))) for stage in IMAGE_STAGES}
    return {
        stage: f"{stage} has shape {np.shape(image)}, not {right[stage]}"
        for stage, image in answers.items()
        if stage in right and np.shape(image) != right[stage]
    }


def without(renderer: Answers, stages: Collection[Stage]) -> Answers:
    """Return the renderer without the answers of some stages."""
    if renderer.error is not None or not stages:
        return renderer
    return replace(renderer, answers={stage: image for stage, image in renderer.answers.items() if stage not in stages})


def well_shaped(scene: Scene, renderer: Answers) -> Answers:
    """Return the renderer without the images that are no answer to the scene."""
    return without(renderer, misshapen(scene, renderer.answers))


# Images (..., channels) reduced over their channels, one by one: over so short an axis NumPy takes ten times as long.
#
# Sums run from the first channel to the last, as NumPy's do: the same bits.


def _reduced(operation: Callable[[np.ndarray, np.ndarray], np.ndarray], image: np.ndarray) -> np.ndarray:
    return reduce(operation, (image[..., channel] for channel in range(image.shape[-1])))


def any_of(image: np.ndarray) -> np.ndarray:
    """Return where any channel is true (...); nowhere without channels."""
    return _reduced(np.logical_or, image) if image.shape[-1] else np.zeros(image.shape[:-1], dtype=bool)


def all_of(image: np.ndarray) -> np.ndarray:
    """Return where all channels are true (...)."""
    return _reduced(np.logical_and, image) if image.shape[-1] else np.ones(image.shape[:-1], dtype=bool)


def largest(image: np.ndarray) -> np.ndarray:
    """Return the largest channel (...); NaN where one is."""
    return _reduced(np.maximum, image)


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return dot products (...) of vectors."""
    # NumPy's sums begin at +0, so that negative zeros add up to +0: atan2 tells the two apart.
    return _reduced(np.add, one * other) + 0.0


def length(vectors: np.ndarray) -> np.ndarray:
    """Return Euclidean lengths (...)."""
    return np.sqrt(dot(vectors, vectors))


def crossed(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of cross products."""
    x, y, z = (one[..., channel] for channel in range(3))
    u, v, w = (other[..., channel] for channel in range(3))
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
    found = near[0]
    for other in near[1:]:
        found = np.maximum(found, other)
    return found
