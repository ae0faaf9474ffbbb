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

MOST_SURFACES = 20_000  # that `certified` is asked about: every ray is held against every one of them
GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


class Oracle(Protocol):
    """The questions to an oracle here."""

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return a stage computed from the given earlier ones."""
        ...


def oracle_for(scene: Scene, precisions: set[str]) -> tuple[str, Oracle]:
    """Return name and oracle, its own rounding far below the coarsest of `precisions` and, if it can, the finest."""
    if precisions != {"float32"} and len(surfaces_of(scene)) <= MOST_SURFACES:
        return "certified", Certified()
    return "analytic", Analytic()


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The exact results of one stage's inputs."""

    value: np.ndarray  # (height, width, channels); of `object` the distance
    objects: np.ndarray | None  # (height, width, 2): the true object, where the stage is to find one
    counts: np.ndarray  # (height, width) bool: the pixels at which the stage has a value
    magnified: np.ndarray  # (height, width) or (height, width, channels): K |X|, the error that one roundoff excuses
    # Unit roundoff -> the objects (height, width, 2) and distances (height, width) of rays a few roundoffs beside the
    # given ones; None where the stage finds no object.
    beside: Callable[[float], list[tuple[np.ndarray, np.ndarray]]] | None = None


def truth_of(scene: Scene, stage: Stage, own: StageImages, oracle: Oracle) -> Truth:
    """Return the truth of an image stage, continued from `own`; the truth of `object` is a distance too.

    Raises:
        ValueError: the camera stage, which is no image.

    """
    size = (scene.camera.height, scene.camera.width)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        seen: StageImages = {Stage.RAY: own[Stage.RAY]}
        for each in GEOMETRY:
            seen[each] = oracle.continue_from(scene, each, seen)
        there = condition(scene, seen)
        return Truth(
            value=seen[Stage.DISTANCE],
            objects=seen[Stage.OBJECT],
            counts=there.hit,
            magnified=there.along_ray,
            beside=cache(partial(_beside, scene, seen, oracle)),
        )
    value = oracle.continue_from(scene, stage, own)
    if stage is Stage.RAY:
        return Truth(
            value=value,
            objects=None,
            counts=np.ones(size, dtype=bool),
            magnified=ray_condition(scene.camera, off_axis(scene.camera, value)),
        )
    return Truth(
        value=value,
        objects=None,
        counts=own[Stage.OBJECT][..., 0] >= 0,
        magnified=_magnified(scene, stage, own, value),
    )


def _beside(
    scene: Scene, seen: StageImages, oracle: Oracle, unit_roundoff: float
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return objects and distances of rays up to `FACTOR` roundoffs beside those of `seen`, in eight ways.

    A backward stable formula answers one of these questions exactly. What the coordinates of eye and surface lose is an
    angle, too: their size over the distance.
    """
    ray, distance = seen[Stage.RAY], seen[Stage.DISTANCE][..., :1]
    reach = float(np.linalg.norm(scene.camera.eye))
    angle = FACTOR * unit_roundoff * (1 + np.where(distance > 0, reach / np.where(distance > 0, distance, 1.0), 0.0))
    # Two directions across each ray
    axis = np.eye(3)[np.abs(ray).argmin(axis=-1)]
    across = unit(np.cross(ray, axis))
    other = np.cross(ray, across)
    found = []
    for turn, part in product(np.arange(WAYS) * 2 * np.pi / WAYS, PARTS):
        turned = ray + part * angle * (np.cos(turn) * across + np.sin(turn) * other)
        turned = unit(turned)
        moved: StageImages = {Stage.RAY: turned}
        for stage in (Stage.OBJECT, Stage.DISTANCE):
            moved[stage] = oracle.continue_from(scene, stage, moved)
        found.append((moved[Stage.OBJECT], moved[Stage.DISTANCE][..., 0]))
    return found


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


# One contender at one stage of one scene: which pixels are decided wrongly, and how far off the others are.


WAYS, PARTS = 8, (1.0, 0.25)  # in which a ray is moved aside, and parts of how far
LEAST = 0.125  # roundoffs: what an exact result counts as, so that its logarithm exists
LEAST_SIZE = 2.0**-900  # what 0 counts as where a roundoff is relative to it, far below every unit in use
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

    counts: np.ndarray  # bool: the stage has a value here, by the truth or by the contender
    wrong: np.ndarray  # bool: false hit, false miss, wrong object, wrong visibility, NaN or infinity
    scaled: np.ndarray  # error / (K u |X|), u the contender's own unit roundoff; NaN where wrong or without a value
    natural: np.ndarray  # error in `UNITS`, likewise
    floored: np.ndarray  # the same, at least what an exact result counts as
    unit_roundoff: float


def measured(
    truth: Truth, stage: Stage, answers: StageImages, *, precision: str, shapes: frozenset[int] | None
) -> Measured:
    """Measure a contender's stage against the truth made from its own earlier stages.

    Of `shapes`, by index, are the pixels that count: those that show one of them by the truth or by the contender;
    None stands for all pixels.
    """
    u = UNIT_ROUNDOFF[precision]
    ours = answers[Stage.DISTANCE if stage is Stage.OBJECT else stage]
    off = error(Stage.DISTANCE if stage is Stage.OBJECT else stage, ours, truth.value)
    per_pixel = off if off.ndim == 2 else off.max(axis=-1, initial=0.0)
    wrong = np.any(ours != truth.value, axis=-1) if stage is Stage.VISIBILITY else ~np.isfinite(per_pixel)
    counts = truth.counts
    if truth.objects is not None:
        found = answers[Stage.OBJECT]
        wrong |= np.any(found != truth.objects, axis=-1) & ~_on_a_shared_edge(truth, found, per_pixel, precision)
        counts = counts | (found[..., 0] >= 0)
        if truth.beside is not None and np.any(wrong):
            # Where rounding may decide, either decision is right, and there is no error to compare.
            explained = wrong & _met_beside(truth.beside(u), found, ours[..., 0], FACTOR * u * truth.magnified)
            wrong, counts = wrong & ~explained, counts & ~explained
        concerned = [found, truth.objects]
    else:
        concerned = [answers[Stage.OBJECT]] if Stage.OBJECT in answers else []
    if shapes is not None:
        counts = counts & np.any([np.isin(one[..., 0], list(shapes)) for one in concerned], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        magnified = truth.magnified if off.ndim == truth.magnified.ndim else truth.magnified[..., np.newaxis]
        # A channel without light has no error and no scale.
        scaled = np.where(off == 0, 0.0, off / magnified / u)
    if scaled.ndim == 3:
        scaled = scaled.max(axis=-1, initial=0.0)
    good = counts & truth.counts & ~wrong & np.isfinite(scaled)
    if stage is Stage.VISIBILITY:
        good = np.zeros_like(good)  # right or wrong; there is no error to be small
    unit = np.degrees(1.0) if stage in DIRECTIONS else 1.0
    return Measured(
        counts=counts,
        wrong=wrong & counts,
        scaled=np.where(good, scaled, np.nan),
        natural=np.where(good, per_pixel * unit, np.nan),
        floored=np.where(good, np.maximum(per_pixel, LEAST * u * _size(stage, truth.value)) * unit, np.nan),
        unit_roundoff=u,
    )


def _on_a_shared_edge(truth: Truth, found: np.ndarray, per_pixel: np.ndarray, precision: str) -> np.ndarray:
    """Return (height, width) where the right object is met at the right distance, by the number of another face.

    On an edge that two faces share either is met.
    """
    assert truth.objects is not None
    limit = FACTOR * UNIT_ROUNDOFF[precision] * truth.magnified
    return (found[..., 0] == truth.objects[..., 0]) & (per_pixel <= limit)


def _met_beside(
    beside: Sequence[tuple[np.ndarray, np.ndarray]], found: np.ndarray, distance: np.ndarray, limit: np.ndarray
) -> np.ndarray:
    """Return (height, width) where a ray beside meets the same face, or the same object at the same distance."""
    met = np.zeros(distance.shape, dtype=bool)
    for objects, distances in beside:
        same = found == objects
        with np.errstate(invalid="ignore"):
            met |= same.all(axis=-1) | (same[..., 0] & (np.abs(distance - distances) <= limit))
    return met


def _size(stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return |X| (height, width): 1 for directions, the largest channel for light; never 0."""
    if stage in DIRECTIONS:
        return np.ones(value.shape[:2])
    return np.maximum(np.abs(value).max(axis=-1, initial=0.0), LEAST_SIZE)


# Two contenders on one scene: the same rays, pixel against pixel.


TILES, PER_TILE = 64, 16  # of pixels in which both contenders found a value, in image order


@dataclass(frozen=True, kw_only=True)
class PairedStage:
    """What one stage of one scene says."""

    pixels: int  # at which the stage has a value
    only_base: int  # pixels that only the base decides wrongly
    only_candidate: int
    both_wrong: int
    same_inputs: bool  # the earlier stages are equal to the last bit
    digits: float  # median over pixels of log10(error of the base / error of the candidate); NaN without errors
    replicates: np.ndarray = field(repr=False)  # of `digits`, pixels drawn again in tiles
    better: float  # share of pixels at which the candidate errs less
    worse: float
    leaning: np.ndarray = field(repr=False)  # (height, width): -1 where only the candidate is far off, 1 only the base
    base: Measured = field(repr=False)
    candidate: Measured = field(repr=False)


def needed(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return what must be rendered so that every one of `stages` can be continued from what came before."""
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

    Only pixels that a change of `slots` can touch count. A truth is made anew where a contender's inputs are others.
    """
    received = as_received(scene)
    shapes = concerned(received, slots)
    contenders = [base, *others]
    _, oracle = oracle_for(received, {one.configuration.precision for one in contenders})
    answers = [render(received, needed(stages), one.configuration) for one in contenders]
    found: list[dict[Stage, PairedStage]] = [{} for _ in others]
    for stage in shown(scene, stages):
        truth = truth_of(received, stage, answers[0], oracle)
        first = measured(truth, stage, answers[0], precision=base.configuration.precision, shapes=shapes)
        for other, given, results in zip(others, answers[1:], found, strict=True):
            same = _same_inputs(stage, answers[0], given)
            own = truth if same else truth_of(received, stage, given, oracle)
            second = measured(own, stage, given, precision=other.configuration.precision, shapes=shapes)
            results[stage] = _pair(first, second, same=same, seed=seed)
    return found


def shown(scene: Scene, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return the stages that a scene has anything to show of: without lights none from the visibility on."""
    lit = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
    return tuple(stage for stage in stages if scene.lights or stage not in lit)


def _same_inputs(stage: Stage, one: StageImages, other: StageImages) -> bool:
    earlier = IMAGE_STAGES[: IMAGE_STAGES.index(stage)]
    return all(np.array_equal(one[each], other[each], equal_nan=True) for each in earlier)


def _pair(base: Measured, candidate: Measured, *, same: bool, seed: int) -> PairedStage:
    ratio = np.log10(base.floored / candidate.floored)
    both = ratio[np.isfinite(ratio)]
    tiles = _tiles(both)
    counts = base.counts | candidate.counts
    # The coarser of two precisions excuses both; what float64 gains beyond it is the digits' affair.
    u = max(base.unit_roundoff, candidate.unit_roundoff)
    return PairedStage(
        pixels=int(np.count_nonzero(counts)),
        only_base=int(np.count_nonzero(base.wrong & ~candidate.wrong)),
        only_candidate=int(np.count_nonzero(candidate.wrong & ~base.wrong)),
        both_wrong=int(np.count_nonzero(base.wrong & candidate.wrong)),
        same_inputs=same,
        digits=float(np.median(both)) if len(both) else float("nan"),
        replicates=tile_medians(tiles, np.random.default_rng(seed)) if len(both) else np.empty(0),
        better=float(np.mean(both > 0)) if len(both) else 0.0,
        worse=float(np.mean(both < 0)) if len(both) else 0.0,
        leaning=leaning(*(one.scaled * (one.unit_roundoff / u) for one in (base, candidate))),
        base=base,
        candidate=candidate,
    )


def _tiles(values: np.ndarray) -> np.ndarray:
    """Return runs of neighbouring values, at most TILES x PER_TILE evenly chosen ones, padded with NaN."""
    per_tile = max(1, min(PER_TILE, len(values) // 8))
    starts = np.unique(np.linspace(0, max(0, len(values) - per_tile), TILES).astype(int))
    places = starts[:, np.newaxis] + np.arange(per_tile)
    return values[np.minimum(places, len(values) - 1)] if len(values) else np.empty((0, per_tile))


# Run times of contenders on one scene: warm kernels, interleaved in random order, compile time apart.
#
# A time is what Dr.Jit's kernel history says the kernels of one launch took, so neither tracing in Python nor the copy
# back counts. Source of the method: Chen and Revels, "Robust benchmarking in noisy environments" (2016): timings are
# not independent and identically distributed, so ratios are taken within a repetition.


RAYS = 2**18  # a launch of fewer measures the launch
LONGEST = 0.02  # s; a slower kernel gets fewer rays


@dataclass(frozen=True, kw_only=True)
class Times:
    """The launches of several contenders on one scene."""

    rays: int
    seconds: np.ndarray = field(repr=False)  # (contenders, repetitions)
    compile_seconds: tuple[float, ...]  # of each contender's first launch; 0 where the kernel was known


@dataclass(frozen=True, kw_only=True)
class Job:
    """A scene to be rendered up to some stages by several contenders."""

    scene: Scene
    stages: tuple[Stage, ...]
    configurations: tuple[Configuration, ...]


def enlarged(scene: Scene, rays: float) -> Scene:
    """Return the scene with the same view and at least `rays` pixels, never fewer than it has."""
    camera = scene.camera
    factor = max(1, int(np.ceil(np.sqrt(rays / (camera.width * camera.height)))))
    return replace(scene, camera=replace(camera, width=camera.width * factor, height=camera.height * factor))


def warmed(job: Job) -> tuple[Scene, tuple[float, ...]]:
    """Return the job's scene with as many rays as a launch of reasonable length takes, and the seconds of compiling."""
    scene = enlarged(job.scene, RAYS)
    built = tuple(launch(scene, job.stages, configuration)[1] for configuration in job.configurations)
    seconds = launch(scene, job.stages, job.configurations[0])[0]
    if seconds > LONGEST:
        # The image's size is a constant of the kernel: another size is another kernel.
        scene = enlarged(job.scene, RAYS * LONGEST / seconds)
        for configuration in job.configurations:
            launch(scene, job.stages, configuration)
    return scene, built


def launch(scene: Scene, stages: Sequence[Stage], configuration: Configuration) -> tuple[float, float]:
    """Return the seconds that the kernels of one launch ran, and those that they took to compile."""
    found = images(Trace.of(scene, configuration, per_side=1), stages)
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        dr.eval(found)
        dr.sync_thread()
        kernels = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    ran = sum(kernel["execution_time"] for kernel in kernels)
    built = sum(kernel["codegen_time"] + kernel["backend_time"] for kernel in kernels if not kernel["cache_hit"])
    return ran * 1e-3, built * 1e-3


def interleaved(jobs: Sequence[Job], *, repetitions: int, generator: np.random.Generator) -> list[Times]:
    """Return the times of each job's contenders; every repetition visits all jobs and contenders in a new order."""
    scenes, built = zip(*map(warmed, jobs), strict=True)
    seconds = [np.empty((len(job.configurations), repetitions)) for job in jobs]
    for repetition in range(repetitions):
        for number in generator.permutation(len(jobs)):
            job = jobs[number]
            for index in generator.permutation(len(job.configurations)):
                one = job.configurations[index]
                seconds[number][index, repetition] = launch(scenes[number], job.stages, one)[0]
    return [
        Times(rays=scene.camera.width * scene.camera.height, seconds=times, compile_seconds=compiled)
        for scene, times, compiled in zip(scenes, seconds, built, strict=True)
    ]
