"""A stage's errors against stage truth, paired pixel by pixel, and the contenders' times, interleaved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import product
from typing import Protocol

import drjit as dr
import numpy as np

from rayproof.cases.placement import unit
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reference.certified import Certified
from rayproof.reference.certified.filters import surfaces_of
from rayproof.reports.judge.forward.conditioning import condition, off_axis, ray_condition
from rayproof.reports.judge.forward.limits import LIGHT, Roundoff, continued_light_limit
from rayproof.reports.judge.measurement import DIRECTIONS, error
from rayproof.reports.studies.compare.contenders import Contender, concerned
from rayproof.reports.studies.compare.records import as_received
from rayproof.reports.studies.compare.statistics import FACTOR, leaning, tile_medians
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.light_path import Trace, images
from rayproof.tracer.render import render

MOST_SURFACES = 20_000  # of a scene for `certified`, which tests every ray against every surface
GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


class Oracle(Protocol):
    """The method of a reference that stage truth needs."""

    def continue_from(self, scene: Scene, stage: Stage, earlier: StageImages, /) -> np.ndarray:
        """Return a stage computed from the given earlier ones."""
        ...


def oracle_for(scene: Scene, precisions: set[str]) -> tuple[str, Oracle]:
    """Return the name and the oracle; its rounding is far below the coarsest precision and, if possible, the finest."""
    if precisions != {"float32"} and len(surfaces_of(scene)) <= MOST_SURFACES:
        return "certified", Certified()
    return "analytic", Analytic()


@dataclass(frozen=True, kw_only=True)
class StageTruth:
    """The exact results of one stage's inputs."""

    value: np.ndarray  # (height, width, channels); for the stage `object` the distance
    objects: np.ndarray | None  # (height, width, 2): the true object, None if the stage finds no object
    counts: np.ndarray  # (height, width) bool: the pixels at which the stage has a value
    magnified: np.ndarray  # (height, width) or (height, width, channels): K |X|, the error that one roundoff explains
    # Unit roundoff -> the objects (height, width, 2) and distances (height, width) of rays a few roundoffs off the
    # original ones; None if the stage finds no object.
    beside: Callable[[float], list[tuple[np.ndarray, np.ndarray]]] | None = None


def truth_of(scene: Scene, stage: Stage, own: StageImages, oracle: Oracle) -> StageTruth:
    """Return the truth of an image stage, continued from the images `own`; the truth of `object` has the distance too.

    Raises:
        ValueError: `stage` is the camera stage, which has no image.

    """
    size = (scene.camera.height, scene.camera.width)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        exact: StageImages = {Stage.RAY: own[Stage.RAY]}
        for geometry_stage in GEOMETRY:
            exact[geometry_stage] = oracle.continue_from(scene, geometry_stage, exact)
        there = condition(scene, exact)
        return StageTruth(
            value=exact[Stage.DISTANCE],
            objects=exact[Stage.OBJECT],
            counts=there.hit,
            magnified=there.along_ray,
            beside=cache(partial(_beside, scene, exact, oracle)),
        )
    value = oracle.continue_from(scene, stage, own)
    if stage is Stage.RAY:
        return StageTruth(
            value=value,
            objects=None,
            counts=np.ones(size, dtype=bool),
            magnified=ray_condition(scene.camera, off_axis(scene.camera, value)),
        )
    return StageTruth(
        value=value,
        objects=None,
        counts=own[Stage.OBJECT][..., 0] >= 0,
        magnified=_magnified(scene, stage, own, value),
    )


def _beside(
    scene: Scene, exact: StageImages, oracle: Oracle, unit_roundoff: float
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the objects and distances of rays turned by up to `FACTOR` roundoffs, in `WAYS` directions.

    A backward stable formula computes the exact hit of one of these rays. Rounding of the coordinates of eye and
    surface also turns a ray: by their size over the distance, times the unit roundoff.
    """
    ray, distance = exact[Stage.RAY], exact[Stage.DISTANCE][..., :1]
    reach = float(np.linalg.norm(scene.camera.eye))
    angle = FACTOR * unit_roundoff * (1 + np.where(distance > 0, reach / np.where(distance > 0, distance, 1.0), 0.0))
    # Two directions across each ray
    axis = np.eye(3)[np.abs(ray).argmin(axis=-1)]
    across = unit(np.cross(ray, axis))
    upwards = np.cross(ray, across)
    turned_hits = []
    for turn, part in product(np.arange(WAYS) * 2 * np.pi / WAYS, PARTS):
        turned = ray + part * angle * (np.cos(turn) * across + np.sin(turn) * upwards)
        turned = unit(turned)
        moved: StageImages = {Stage.RAY: turned}
        for stage in (Stage.OBJECT, Stage.DISTANCE):
            moved[stage] = oracle.continue_from(scene, stage, moved)
        turned_hits.append((moved[Stage.OBJECT], moved[Stage.DISTANCE][..., 0]))
    return turned_hits


def _magnified(scene: Scene, stage: Stage, own: StageImages, value: np.ndarray) -> np.ndarray:
    """Return K |X| of the stages after the distance."""
    if stage is Stage.POSITION:
        distance = own[Stage.DISTANCE][..., 0]
        return float(np.linalg.norm(scene.camera.eye)) + np.where(np.isfinite(distance), np.abs(distance), 0.0)
    if stage is Stage.NORMAL:
        there = condition(scene, {**own, Stage.NORMAL: value})
        return there.matrix * (1 + there.local)
    if stage is Stage.IRRADIANCE:
        limit = continued_light_limit(scene, stage, own, value, Roundoff("float32"))
        return limit / LIGHT / UNIT_ROUNDOFF["float32"]
    return np.abs(value)


# One contender at one stage of one scene: the wrongly decided pixels, and the errors of the others.


WAYS, PARTS = 8, (1.0, 0.25)  # number of directions to turn a ray towards, and fractions of the largest angle
LEAST = 0.125  # roundoffs: the least error, used for an exact result so that its logarithm exists
LEAST_SIZE = 2.0**-900  # the size of a value of 0, so that a roundoff relative to it exists; far below every unit
UNITS: dict[Stage, str] = {
    Stage.RAY: "degrees",
    Stage.OBJECT: "m",
    Stage.DISTANCE: "m",
    Stage.POSITION: "m",
    Stage.NORMAL: "degrees",
    Stage.VISIBILITY: "",
    Stage.IRRADIANCE: "W/m^2",
    Stage.EXITANCE: "W/m^2",
    Stage.RADIANCE: "W/(m^2 sr)",
}


@dataclass(frozen=True, kw_only=True)
class Measured:
    """All pixels (height, width) of one contender at one stage."""

    counts: np.ndarray  # bool: the stage has a value at this pixel, in the truth or in the contender's image
    wrong: np.ndarray  # bool: false hit, false miss, wrong object, wrong visibility, NaN or infinity
    scaled: np.ndarray  # error / (K u |X|), u the contender's own unit roundoff; NaN where wrong or without a value
    natural: np.ndarray  # error in `UNITS`; NaN at the same pixels
    floored: np.ndarray  # `natural`, but at least the error of `LEAST` roundoffs
    unit_roundoff: float


def measured(
    truth: StageTruth, stage: Stage, answers: StageImages, *, precision: str, shapes: frozenset[int] | None
) -> Measured:
    """Measure a contender's stage against the truth made from its own earlier stages.

    Only pixels count that show one of the `shapes` (indices) in the truth or in the contender's image; if None, all.
    """
    u = UNIT_ROUNDOFF[precision]
    computed = answers[Stage.DISTANCE if stage is Stage.OBJECT else stage]
    off = error(Stage.DISTANCE if stage is Stage.OBJECT else stage, computed, truth.value)
    per_pixel = off if off.ndim == 2 else off.max(axis=-1, initial=0.0)
    wrong = np.any(computed != truth.value, axis=-1) if stage is Stage.VISIBILITY else ~np.isfinite(per_pixel)
    counts = truth.counts
    if truth.objects is not None:
        objects = answers[Stage.OBJECT]
        wrong |= np.any(objects != truth.objects, axis=-1) & ~_on_a_shared_edge(truth, objects, per_pixel, precision)
        counts = counts | (objects[..., 0] >= 0)
        if truth.beside is not None and np.any(wrong):
            # Pixels whose decision is explained by rounding: either decision is right, and there is no error to compare
            explained = wrong & _met_beside(truth.beside(u), objects, computed[..., 0], FACTOR * u * truth.magnified)
            wrong, counts = wrong & ~explained, counts & ~explained
        concerned = [objects, truth.objects]
    else:
        concerned = [answers[Stage.OBJECT]] if Stage.OBJECT in answers else []
    if shapes is not None:
        counts = counts & np.any([np.isin(image[..., 0], list(shapes)) for image in concerned], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        magnified = truth.magnified if off.ndim == truth.magnified.ndim else truth.magnified[..., np.newaxis]
        # A channel without light has no error and no scale.
        scaled = np.where(off == 0, 0.0, off / magnified / u)
    if scaled.ndim == 3:
        scaled = scaled.max(axis=-1, initial=0.0)
    good = counts & truth.counts & ~wrong & np.isfinite(scaled)
    if stage is Stage.VISIBILITY:
        good = np.zeros_like(good)  # a visibility is right or wrong and has no error
    unit = np.degrees(1.0) if stage in DIRECTIONS else 1.0
    return Measured(
        counts=counts,
        wrong=wrong & counts,
        scaled=np.where(good, scaled, np.nan),
        natural=np.where(good, per_pixel * unit, np.nan),
        floored=np.where(good, np.maximum(per_pixel, LEAST * u * _size(stage, truth.value)) * unit, np.nan),
        unit_roundoff=u,
    )


def _on_a_shared_edge(truth: StageTruth, objects: np.ndarray, per_pixel: np.ndarray, precision: str) -> np.ndarray:
    """Return the mask (height, width) of hits of the right object at the right distance but on another face.

    On an edge that two faces share, a hit of either face is right.
    """
    assert truth.objects is not None
    limit = FACTOR * UNIT_ROUNDOFF[precision] * truth.magnified
    return (objects[..., 0] == truth.objects[..., 0]) & (per_pixel <= limit)


def _met_beside(
    beside: Sequence[tuple[np.ndarray, np.ndarray]], computed: np.ndarray, distance: np.ndarray, limit: np.ndarray
) -> np.ndarray:
    """Return the mask (height, width) of hits that a turned ray has too: the same face, or object and distance.

    `beside` has the objects and distances of the turned rays, as `_beside` returns them.
    """
    explained = np.zeros(distance.shape, dtype=bool)
    for objects, distances in beside:
        same = computed == objects
        with np.errstate(invalid="ignore"):
            explained |= same.all(axis=-1) | (same[..., 0] & (np.abs(distance - distances) <= limit))
    return explained


def _size(stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return |X| (height, width): 1 for directions, the largest channel for light; never 0."""
    if stage in DIRECTIONS:
        return np.ones(value.shape[:2])
    return np.maximum(np.abs(value).max(axis=-1, initial=0.0), LEAST_SIZE)


# Two contenders on one scene: the same rays, pixel against pixel.


TILES, PER_TILE = 64, 16  # tiles, and pixels per tile, of the pixels where both contenders have a value, in image order


@dataclass(frozen=True, kw_only=True)
class PairedStage:
    """The paired errors of one stage of one scene."""

    pixels: int  # at which the stage has a value
    only_base: int  # pixels that only the base decides wrongly
    only_candidate: int
    both_wrong: int
    same_inputs: bool  # the earlier stages are equal to the last bit
    digits: float  # median over pixels of log10(error of the base / error of the candidate); NaN without errors
    replicates: np.ndarray = field(repr=False)  # bootstrap replicates of `digits`, pixels resampled in tiles
    better: float  # share of pixels at which the candidate errs less
    worse: float
    leaning: np.ndarray = field(repr=False)  # (height, width): -1 where only the candidate is far off, 1 only the base
    base: Measured = field(repr=False)
    candidate: Measured = field(repr=False)


def needed(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return the stages to render so that each of `stages` can be continued from its earlier stages."""
    last = max(IMAGE_STAGES.index(Stage.DISTANCE if stage is Stage.OBJECT else stage) for stage in stages)
    return IMAGE_STAGES[: last + 1]


def paired(
    scene: Scene,
    stages: tuple[Stage, ...],
    base: Contender,
    others: Sequence[Contender],
    *,
    slots: Sequence[str],
    seed: int,
) -> list[dict[Stage, PairedStage]]:
    """Return the comparison of `base` with each of `others` on a scene, stage by stage.

    Only pixels that a change of `slots` can affect count. A contender whose inputs differ from the base's gets a truth
    of its own.
    """
    received = as_received(scene)
    shapes = concerned(received, slots)
    contenders = [base, *others]
    _, oracle = oracle_for(received, {contender.configuration.precision for contender in contenders})
    answers = [render(received, needed(stages), contender.configuration) for contender in contenders]
    paired_stages: list[dict[Stage, PairedStage]] = [{} for _ in others]
    for stage in shown(scene, stages):
        truth = truth_of(received, stage, answers[0], oracle)
        first = measured(truth, stage, answers[0], precision=base.configuration.precision, shapes=shapes)
        for alternative, answer, results in zip(others, answers[1:], paired_stages, strict=True):
            same = _same_inputs(stage, answers[0], answer)
            own = truth if same else truth_of(received, stage, answer, oracle)
            second = measured(own, stage, answer, precision=alternative.configuration.precision, shapes=shapes)
            results[stage] = _pair(first, second, same=same, seed=seed)
    return paired_stages


def shown(scene: Scene, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return the stages that a scene has values of: without lights, those before the visibility."""
    lit = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
    return tuple(stage for stage in stages if scene.lights or stage not in lit)


def _same_inputs(stage: Stage, first: StageImages, second: StageImages) -> bool:
    earlier = IMAGE_STAGES[: IMAGE_STAGES.index(stage)]
    return all(np.array_equal(first[earlier_stage], second[earlier_stage], equal_nan=True) for earlier_stage in earlier)


def _pair(base: Measured, candidate: Measured, *, same: bool, seed: int) -> PairedStage:
    ratio = np.log10(base.floored / candidate.floored)
    shared = ratio[np.isfinite(ratio)]
    tiles = _tiles(shared)
    counts = base.counts | candidate.counts
    # The tail is measured in roundings of the coarser precision; the gain of the finer one is counted by `digits`.
    u = max(base.unit_roundoff, candidate.unit_roundoff)
    return PairedStage(
        pixels=int(np.count_nonzero(counts)),
        only_base=int(np.count_nonzero(base.wrong & ~candidate.wrong)),
        only_candidate=int(np.count_nonzero(candidate.wrong & ~base.wrong)),
        both_wrong=int(np.count_nonzero(base.wrong & candidate.wrong)),
        same_inputs=same,
        digits=float(np.median(shared)) if len(shared) else float("nan"),
        replicates=tile_medians(tiles, np.random.default_rng(seed)) if len(shared) else np.empty(0),
        better=float(np.mean(shared > 0)) if len(shared) else 0.0,
        worse=float(np.mean(shared < 0)) if len(shared) else 0.0,
        leaning=leaning(*(side.scaled * (side.unit_roundoff / u) for side in (base, candidate))),
        base=base,
        candidate=candidate,
    )


def _tiles(values: np.ndarray) -> np.ndarray:
    """Return evenly spaced runs of neighbouring values, at most TILES of PER_TILE values each."""
    per_tile = max(1, min(PER_TILE, len(values) // 8))
    starts = np.unique(np.linspace(0, max(0, len(values) - per_tile), TILES).astype(int))
    places = starts[:, np.newaxis] + np.arange(per_tile)
    return values[np.minimum(places, len(values) - 1)] if len(values) else np.empty((0, per_tile))


# Run times of contenders on one scene: warm kernels, interleaved in random order, compile time measured separately.
#
# A time is the execution time of the kernels of one launch in Dr.Jit's kernel history, so neither tracing in Python nor
# the copy back counts. Source of the method: Chen and Revels, "Robust benchmarking in noisy environments" (2016):
# timings are not independent and identically distributed, so ratios are taken within a repetition.


RAYS = 2**18  # with fewer rays the overhead of the launch dominates
LONGEST = 0.02  # s; a slower kernel gets fewer rays


@dataclass(frozen=True, kw_only=True)
class LaunchTimes:
    """The launches of several contenders on one scene."""

    rays: int
    seconds: np.ndarray = field(repr=False)  # (contenders, repetitions)
    compile_seconds: tuple[float, ...]  # of each contender's first launch; 0 if the kernel was cached


@dataclass(frozen=True, kw_only=True)
class Job:
    """A scene to be rendered up to some stages by several contenders."""

    scene: Scene
    stages: tuple[Stage, ...]
    configurations: tuple[Configuration, ...]


def enlarged(scene: Scene, rays: float) -> Scene:
    """Return the scene with the same view and at least `rays` pixels, and not fewer than the original."""
    camera = scene.camera
    factor = max(1, int(np.ceil(np.sqrt(rays / (camera.width * camera.height)))))
    return replace(scene, camera=replace(camera, width=camera.width * factor, height=camera.height * factor))


def warmed(job: Job) -> tuple[Scene, tuple[float, ...]]:
    """Return the job's scene, enlarged to a launch of reasonable length, and each configuration's compile time [s]."""
    scene = enlarged(job.scene, RAYS)
    built = tuple(launch(scene, job.stages, configuration)[1] for configuration in job.configurations)
    seconds = launch(scene, job.stages, job.configurations[0])[0]
    if seconds > LONGEST:
        # The image's size is a constant of the kernel, so the new size needs kernels of its own.
        scene = enlarged(job.scene, RAYS * LONGEST / seconds)
        for configuration in job.configurations:
            launch(scene, job.stages, configuration)
    return scene, built


def launch(scene: Scene, stages: Sequence[Stage], configuration: Configuration) -> tuple[float, float]:
    """Return the run time and the compile time [s] of the kernels of one launch."""
    arrays = images(Trace.of(scene, configuration, per_side=1), stages)
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        dr.eval(arrays)
        dr.sync_thread()
        kernels = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    ran = sum(kernel["execution_time"] for kernel in kernels)
    built = sum(kernel["codegen_time"] + kernel["backend_time"] for kernel in kernels if not kernel["cache_hit"])
    return ran * 1e-3, built * 1e-3


def interleaved(jobs: Sequence[Job], *, repetitions: int, generator: np.random.Generator) -> list[LaunchTimes]:
    """Return the times of each job's contenders; every repetition visits all jobs and contenders in a new order."""
    scenes, built = zip(*map(warmed, jobs), strict=True)
    seconds = [np.empty((len(job.configurations), repetitions)) for job in jobs]
    for repetition in range(repetitions):
        for number in generator.permutation(len(jobs)):
            job = jobs[number]
            for index in generator.permutation(len(job.configurations)):
                configuration = job.configurations[index]
                seconds[number][index, repetition] = launch(scenes[number], job.stages, configuration)[0]
    return [
        LaunchTimes(rays=scene.camera.width * scene.camera.height, seconds=times, compile_seconds=compiled)
        for scene, times, compiled in zip(scenes, seconds, built, strict=True)
    ]
