"""Other ways in which the tracer renders a scene, each beside the way by which a run judges it.

A run renders all stages in kernels of their own (`tracer.kernel.parameters.SplitKernels`), and its answers are held
against the references. What else renders a scene is held against those answers here: to the last bit where the
arithmetic is the same operation by operation, else within a limit that counts the roundings which may differ. Who
agrees with a judged answer is judged with it.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.plan import Plan, plan
from rayproof.tracer.render import render
from tests.harness.paths.declared import STAGES, Rendering

SIDE = 2  # samples across a pixel, where there are several: a power of two, so that their places are the same numbers
# Literals fold: a division by one becomes a product with its reciprocal, a product or a root of two is the host's. It
# concerns three roundings of a normal and three of light, each of which is another one on either side.
FOLDED = 2 * (3 + 3)
EQUAL = "to the last bit"
WHOLE, ONE_LOOP = "whole triangles", "one loop"
PIPELINED = {"columns": 4, "rows": 2, "split": False, "pipelined": True}


# "with" is a word of Python's.
Comparison = TypedDict(
    "Comparison",
    {
        "case": str,
        "path": str,
        "configuration": str,
        "with": str,
        "how": str,
        "stage": str | None,
        "pixels": int,
        "worst": float,
        "verdict": str,
        "differ": int,
        "pixel": list[int] | None,
    },
    total=False,
)


def full_light(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return the radiance of each pixel if every light that it sees stood in its zenith, (height, width, 3)."""
    albedo = np.array([shape.albedo for shape in scene.shapes] or [(0.0, 0.0, 0.0)])
    hit = answers[Stage.OBJECT][..., 0].astype(int)
    leaving = np.where((hit >= 0)[..., np.newaxis], albedo[np.clip(hit, 0, None)], 0.0)
    total = np.zeros(leaving.shape)
    for number, light in enumerate(scene.lights):
        seen = answers[Stage.VISIBILITY][..., number : number + 1]
        if scene.shading == "simplified":
            total += seen * np.array(light.flux)
            continue
        away = np.asarray(light.position) - answers[Stage.POSITION]
        with np.errstate(divide="ignore"):
            total += seen * np.array(light.flux) / (4 * math.pi**2 * np.sum(away**2, axis=-1, keepdims=True))
    return leaving * total


@dataclass(frozen=True, kw_only=True)
class Compared:
    """One stage's image by one route beside the same image by another."""

    stage: Stage
    image: np.ndarray  # by the route
    beside: np.ndarray  # by the other one
    limit: np.ndarray | None  # of the difference; None: no bit may differ


@dataclass(frozen=True, kw_only=True)
class Route:
    """A way of rendering; `compare` yields its images beside those that it is held against."""

    name: str
    what: str
    beside: str  # what it is held against
    how: str
    compare: Callable[[Scene, Configuration, StageImages], Iterator[Compared]]
    suits: Callable[[Scene, Configuration], bool] = lambda scene, configuration: True


def _radiance(
    scene: Scene, configuration: Configuration, *, samples: int = 1, chosen: Plan | None = None
) -> np.ndarray:
    return render(scene, (Stage.RADIANCE,), configuration, samples=samples, chosen=chosen)[Stage.RADIANCE]


def _judged(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return the judged radiance; where there is no light nobody asks for it, and it is 0."""
    if Stage.RADIANCE in answers:
        return answers[Stage.RADIANCE]
    return np.zeros((scene.camera.height, scene.camera.width, 3))


def _numbers(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
    image = _radiance(scene, configuration)
    yield Compared(stage=Stage.RADIANCE, image=image, beside=_judged(scene, answers), limit=None)


def _frames(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
    limit = gamma(FOLDED, precision=configuration.precision) * full_light(scene, answers)
    image = Frames(scene, configuration).pixels().astype(np.float64)
    yield Compared(stage=Stage.RADIANCE, image=image, beside=_judged(scene, answers), limit=limit)


def by_tiles(usual: Plan) -> Plan:
    """Return a plan by which a lane takes four neighbours, whose numbers a frozen kernel writes at once."""
    return replace(usual, columns=4, rows=2 if usual.trees else 1, split=False)


def _frames_of_tiles(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
    limit = gamma(FOLDED, precision=configuration.precision) * full_light(scene, answers)
    image = Frames(scene, configuration, chosen=by_tiles(plan(scene, configuration))).pixels().astype(np.float64)
    yield Compared(stage=Stage.RADIANCE, image=image, beside=_judged(scene, answers), limit=limit)


def _samples(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
    large = finer(scene, SIDE)
    beside = box_mean(render(large, IMAGE_STAGES, configuration)[Stage.RADIANCE], SIDE)
    yield Compared(stage=Stage.RADIANCE, image=_radiance(scene, configuration, samples=SIDE), beside=beside, limit=None)


def _frames_of_samples(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
    large = render(finer(scene, SIDE), IMAGE_STAGES, configuration)
    # Added up one by one and divided by how many there are, in the working precision.
    roundings = FOLDED + SIDE * SIDE + 1
    limit = gamma(roundings, precision=configuration.precision) * box_mean(full_light(scene, large), SIDE)
    image = Frames(scene, configuration, samples=SIDE).pixels().astype(np.float64)
    yield Compared(stage=Stage.RADIANCE, image=image, beside=box_mean(large[Stage.RADIANCE], SIDE), limit=limit)


def _by_plan(change: Mapping[str, Any]) -> Callable[[Scene, Configuration, StageImages], Iterator[Compared]]:
    def compare(scene: Scene, configuration: Configuration, answers: StageImages) -> Iterator[Compared]:
        chosen = replace(plan(scene, configuration), **change)
        images = render(scene, IMAGE_STAGES, configuration, chosen=chosen)
        for stage in (stage for stage in IMAGE_STAGES if stage in answers):
            yield Compared(stage=stage, image=images[stage], beside=answers[stage], limit=None)

    return compare


def _unrolled(scene: Scene, configuration: Configuration) -> bool:
    return not plan(scene, configuration).trees


def _in_trees(scene: Scene, configuration: Configuration) -> bool:
    return bool(plan(scene, configuration).trees)


def _turned_alike(scene: Scene, configuration: Configuration) -> bool:
    """Say whether a larger tile turns its triangles as a smaller one does.

    The rays of a narrow tile turn as the one in its middle, which is another ray in a tile of another size; t then
    moves by a rounding now and then. Views of 90 degrees and more turn each ray by itself.
    """
    trees = plan(scene, configuration).trees
    return bool(trees) and ("triangle" not in trees or scene.camera.fovy >= 90)


def _cut(scene: Scene, configuration: Configuration) -> bool:
    """Say whether triangles stand in their tree in parts."""
    return Rendering(scene=scene, configuration=configuration, plan=plan(scene, configuration), route=STAGES).in_parts


def _in_packets(scene: Scene, configuration: Configuration) -> bool:
    """Say whether rows are made of whole packets, and triangles turn as they do by another plan."""
    trees = plan(scene, configuration).trees
    return scene.camera.width % 4 == 0 and ("triangle" not in trees or _turned_alike(scene, configuration))


def _tile(columns: int, rows: int, suits: Callable[[Scene, Configuration], bool]) -> Route:
    return Route(
        name=f"tiles of {columns} x {rows}",
        what=f"a lane takes {columns} x {rows} samples, and one kernel does all: what images of 2^17 samples take",
        beside="stages, by the plan that the scene chooses",
        how=EQUAL,
        compare=_by_plan({"columns": columns, "rows": rows, "split": False}),
        suits=suits,
    )


JUDGED = "the stages that the references judged"
FOLDING = f"radiance within gamma({FOLDED}) of full light: the roundings of literals that are folded"
ROUTES: Mapping[str, Route] = {
    route.name: route
    for route in (
        Route(
            name="numbers",
            what="one fused kernel, the scene's numbers in memory: `rayproof render`",
            beside=JUDGED,
            how=EQUAL,
            compare=_numbers,
        ),
        Route(
            name="frames",
            what="one frozen kernel, the scene's numbers as literals in its code: `tests.benchmarks.bench`",
            beside=JUDGED,
            how=FOLDING,
            compare=_frames,
        ),
        Route(
            name="samples",
            what=f"{SIDE} x {SIDE} samples a pixel, and their mean",
            beside="stages of the image that many times as wide and high",
            how=EQUAL,
            compare=_samples,
        ),
        Route(
            name="frames of samples",
            what=f"{SIDE} x {SIDE} samples a pixel, one after the other in a loop of the frozen kernel",
            beside="stages of the image that many times as wide and high",
            how=f"radiance within gamma({FOLDED + SIDE * SIDE + 1}) of full light: literals, the sum and the mean",
            compare=_frames_of_samples,
        ),
        Route(
            name="frames of tiles",
            what="one frozen kernel, a lane of which writes four neighbours at once",
            beside=JUDGED,
            how=FOLDING,
            compare=_frames_of_tiles,
            suits=_in_packets,
        ),
        _tile(8, 1, _unrolled),
        _tile(4, 1, _unrolled),
        _tile(4, 4, _turned_alike),
        _tile(4, 2, _turned_alike),
        _tile(2, 2, _in_trees),
        Route(
            name=ONE_LOOP,
            what="4 x 2 samples a lane, one loop through the tree of triangles: where they are as small as samples",
            beside="stages, by the plan that the scene chooses: a loop in a loop",
            how=EQUAL,
            compare=_by_plan(PIPELINED),
            suits=lambda scene, configuration: (
                _turned_alike(scene, configuration) and "triangle" in plan(scene, configuration).trees
            ),
        ),
        Route(
            name=WHOLE,
            what="long slanting triangles stand in their tree as wholes, as all others do",
            beside="stages, by the plan that the scene chooses: in parts",
            how=EQUAL,
            compare=_by_plan({"parts": False}),
            suits=_cut,
        ),
    )
}


def compare(route: str, scene: Scene, configuration: Configuration, answers: StageImages) -> Comparison:
    """Return how one route compares: the first stage that differs by more than its limit.

    `worst` is the largest difference as a multiple of the limit; where no bit may differ, 0 or inf. `differ` counts
    the pixels beyond it, `pixels` those of all stages.
    """
    by = ROUTES[route]
    pixels, worst, first = 0, 0.0, None
    for one in by.compare(scene, configuration, answers):
        ratio = _ratios(one)
        pixels += ratio.size
        worst = max(worst, float(ratio.max(initial=0.0)))
        beyond = ratio > 1
        if first is None and beyond.any():
            row, column = (int(at) for at in np.unravel_index(int(ratio.argmax()), ratio.shape))
            first = one.stage.value, int(beyond.sum()), [column, row]
    stage, differ, pixel = (None, 0, None) if first is None else first
    return {
        "path": route,
        "configuration": configuration.name,
        "with": by.beside,
        "how": by.how,
        "pixels": pixels,
        "worst": worst,
        "verdict": "pass" if first is None else "fail",
        "stage": stage,
        "differ": differ,
        "pixel": pixel,
    }


def _ratios(one: Compared) -> np.ndarray:
    """Return each pixel's difference over its limit, (height, width)."""
    if one.image.shape != one.beside.shape:
        return np.full(one.beside.shape[:2], math.inf)
    same = (one.image == one.beside) | (np.isnan(one.image) & np.isnan(one.beside))
    if one.limit is None:
        return np.where(same.all(axis=-1), 0.0, math.inf)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratio = np.abs(one.image - one.beside) / one.limit
    # What is no number agrees with nothing but itself.
    return np.where(same, 0.0, np.where(np.isnan(ratio), math.inf, ratio)).max(axis=-1)


def suiting(routes: Collection[str], scene: Scene, configuration: Configuration) -> tuple[str, ...]:
    """Return those of the routes that a scene can take, in the order of `ROUTES`."""
    return tuple(name for name, route in ROUTES.items() if name in routes and route.suits(scene, configuration))


# Which case is rendered by which other route: few of them, since a frozen kernel is compiled for each scene.
#
# Every route is asked about two cases at least, and each about what it alone does: literals where coefficients are -1,
# tables and lights in turn for radiance alone, samples where the width is odd, tiles of each size over each tree.

# Case -> the routes by which its radiance, or all its stages, are rendered too.
CHOICE: Mapping[str, tuple[str, ...]] = {
    "alone/concave_mesh": ("numbers", "frames", "tiles of 4 x 4", "tiles of 2 x 2", "one loop"),
    "antialiased/cube": ("samples", "frames of samples", "tiles of 8 x 1"),
    "clipping/faces_none": ("numbers", "frames"),
    "crowds/cubes": ("tiles of 4 x 4",),
    "crowds/ellipsoids": ("numbers", "frames"),
    "crowds/of_several_kinds": ("numbers", "frames", "tiles of 4 x 1"),
    "crowds/squares": ("frames", "frames of tiles", "tiles of 4 x 2"),
    "faces/nine": ("numbers", "frames", "samples", "frames of samples", "tiles of 2 x 2"),
    "flux_conservation/west": ("numbers", "frames"),
    "meshes/rods_above_a_sheet": ("whole triangles",),
    "meshes/slivers": ("frames", "tiles of 2 x 2", "whole triangles"),
    "meshes/wavy_sheet_from_behind": ("tiles of 4 x 4", "tiles of 4 x 2", "one loop"),
    "parallel_rays/flat": ("frames",),
    "several_lights/eight": ("numbers", "frames", "tiles of 4 x 1"),
    "several_lights/simplified": ("frames",),
    "shadows/behind_a_plane": ("tiles of 8 x 1",),
    "shadows/every_blocker": ("numbers", "frames of tiles", "tiles of 8 x 1"),
}
NAMES = (
    "numbers",
    "frames",
    "samples",
    "frames of samples",
    "frames of tiles",
    "tiles of 8 x 1",
    "tiles of 4 x 1",
    "tiles of 4 x 4",
    "tiles of 4 x 2",
    "tiles of 2 x 2",
    "one loop",
    "whole triangles",
)


SHORT = ("numbers", "frames", "samples", "frames of samples")  # their kernels compile in a second, in float64 too
ROUTED = ("float32", "float64")  # configurations; another formula runs through the same routes


def asked(routes: tuple[str, ...], configuration: str) -> tuple[str, ...]:
    """Return those of a case's routes by which one configuration renders it.

    A tile's kernel takes some three seconds to compile in float64: only who asks for everything gets it.
    """
    if configuration not in ROUTED:
        return ()
    if configuration == ROUTED[0] or routes == NAMES:
        return routes
    return tuple(route for route in routes if route in SHORT)
