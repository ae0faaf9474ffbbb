"""The list of diagrams, and `measure`, which fills them; diagrams of samples per pixel; means over diagrams."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.ladders import Ladder
from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.cases.stresses import STRESSES
from rayproof.reference.analytic import Analytic
from rayproof.reference.mitsuba3 import MitsubaLlvm, MitsubaScalar, program
from rayproof.reference.mitsuba3.program import radiance_image
from rayproof.reference.mitsuba3.scene import load_scene
from rayproof.reports.results.files import SCHEMA
from rayproof.reports.results.provenance import origin
from rayproof.reports.studies.compare.contenders import concerned, stresses_and_cases
from rayproof.reports.studies.compare.paired_errors import enlarged, launch
from rayproof.reports.studies.tradeoff.formulas import LADDER, Task, entries, ladder_entries, ladders, pixels, variants
from rayproof.reports.studies.tradeoff.points import (
    SEED,
    DiagramRecord,
    Launch,
    TradeoffPoint,
    TradeoffRecord,
    UntimedPoint,
    front,
    interleave,
    kernel_seconds,
    point_record,
    root_mean_square,
    wall_seconds,
)
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import SHAPES_OF, Formula
from rayproof.tracer.kernel.arrays import versions
from rayproof.tracer.render import render

DEFAULT = (
    "far_sphere_*", "far_cube_1e3", "far_triangle_1e3", "tangent_sphere", "sliver_*", "grazing_plane",
    "primitives", "antialiased", "shadows", "SPH-FAR", "SPH-TAN", "TRI-SLIV", "BOX-FAR", "CAM-NEAR",
)  # fmt: skip
QUICK = ("far_sphere_1e3", "antialiased", "SPH-FAR")
SLOTS = ("sphere", "cube", "square", "plane", "triangle")
MOST_SCENES = 2  # per diagram, of one family


def tasks(
    selectors: Sequence[str], formulas: Sequence[Formula] = (), files: Sequence[Case] = ()
) -> tuple[tuple[Task, ...], tuple[tuple[str, Scene], ...], tuple[Ladder, ...]]:
    """Return the diagrams of formulas, of whole images and of ladders that `selectors` name, and of scene `files`.

    If `formulas` is not empty, the diagrams show only these and the defaults of their slots, and no whole images.

    Raises:
        LookupError: a selector names neither a case nor a stress nor a ladder, or no selected scene or ladder depends
            on the formulas.

    """
    wanted = tuple(formulas)
    climbed = tuple(ladder for ladder in ladders(selectors) if any(variants(slot, wanted) for slot in ladder.slots))
    stresses, cases = stresses_and_cases([selector for selector in selectors if not ladders([selector])])
    families = {
        name: [case for case in cases if case.family == name] for name in dict.fromkeys(c.family for c in cases)
    } | {case.name.replace("/", "-"): [case] for case in files}
    wanted_tasks = [
        task
        for name in stresses
        for slot in STRESSES.about(name)["slots"]
        if slot in SLOTS and (task := _task(name, slot, [scene for _, scene in STRESSES[name]()], wanted)) is not None
    ]
    wanted_tasks += [
        task
        for name, members in families.items()
        for slot in SLOTS
        if (task := _task(name, slot, [case.scene for case in members], wanted)) is not None
    ]
    sampled = []
    for name, members in families.items() if not wanted else ():
        lit = [case for case in members if case.scene.lights and case.scene.clip == "depth"]
        # The case with the most samples per pixel comes first.
        lit.sort(key=lambda case: -case.samples)
        if lit:
            sampled.append((name, lit[0].scene))
    if wanted and not wanted_tasks and not climbed:
        raise LookupError("none of the scenes and ladders named shows any of the formulas named")
    return tuple(wanted_tasks), tuple(sampled), climbed


def _task(family: str, slot: str, scenes: Sequence[Scene], named: tuple[Formula, ...]) -> Task | None:
    """Return the diagram of a slot on a family; None for fewer than two formulas or if no scene depends on the slot."""
    formulas = variants(slot, named)
    if slot not in SHAPES_OF or len(formulas) < 2:
        return None
    showing = tuple(scene for scene in scenes if concerned(scene, [slot]))[:MOST_SCENES]
    return Task(diagram=f"{slot}/{family}", slot=slot, formulas=formulas, scenes=showing) if showing else None


# Diagrams of samples per pixel: box-filtered radiance of the tracer and of Mitsuba against the analytic reference.


PER_SIDE = (1, 2, 4, 8)  # 1, 4, 16, 64 samples per pixel
# The truth's own sampling error falls as 1 / samples per side (an outline crosses that many cells): with 32 per side it
# is a quarter of the error with 8.
TRUTH_PER_SIDE = 32
WIDEST = 24  # px: the truth takes a thousand rays per pixel
SAMPLES_TIMED = 2**18  # rays in a launch of the tracer
SAMPLES_WALL = 2**16  # rays in a launch of Mitsuba


def small(scene: Scene) -> Scene:
    """Return the scene with the same view and an image of at most WIDEST pixels in width and height."""
    camera = scene.camera
    shrink = min(1.0, WIDEST / max(camera.width, camera.height))
    width, height = (max(1, round(size * shrink)) for size in (camera.width, camera.height))
    return replace(scene, camera=replace(camera, width=width, height=height))


def sampling_entries(diagram: str, scene: Scene, tell: Callable[[str], None]) -> list[UntimedPoint]:
    """Return the points of one diagram, measured and ready to be timed; times are per pixel."""
    tell(f"{diagram}: samples per pixel")
    shrunk = small(scene)
    truth = Analytic().render(shrunk, [Stage.RADIANCE], samples=TRUTH_PER_SIDE)[Stage.RADIANCE]
    records = []
    for precision in PRECISIONS:
        configuration = Configuration(precision=precision)
        for per_side in PER_SIDE:
            large = enlarged(shrunk, SAMPLES_TIMED / per_side**2)
            image = render(shrunk, [Stage.RADIANCE], configuration, samples=per_side)[Stage.RADIANCE]
            records.append(
                UntimedPoint(
                    point=_point(diagram, "tracer", precision, per_side, "kernels", image, truth),
                    launch=partial(_traced, large, configuration, per_side),
                    rays=pixels(large),
                )
            )
    for name, kind in (("mitsuba_llvm", MitsubaLlvm), ("mitsuba_scalar", MitsubaScalar)):
        reference = kind()
        # Mitsuba's camera clips at planes; with another clipping it would render another image.
        if shrunk.clip != "depth" or reference.unsupported(shrunk, Stage.RADIANCE) is not None:
            continue
        clock = "kernels" if kind is MitsubaLlvm else "wall"
        for per_side in PER_SIDE:
            large = enlarged(shrunk, SAMPLES_WALL / per_side**2)
            image = reference.render(shrunk, [Stage.RADIANCE], samples=per_side)[Stage.RADIANCE]
            records.append(
                UntimedPoint(
                    point=_point(diagram, name, "float32", per_side, clock, image, truth),
                    launch=_mitsuba(kind.variant, large, per_side, clock),
                    rays=pixels(large),
                )
            )
    return records


def _point(
    diagram: str, renderer: str, precision: str, per_side: int, clock: str, image: np.ndarray, truth: np.ndarray
) -> TradeoffPoint:
    error, interval = root_mean_square(image, truth)
    return TradeoffPoint(
        diagram=diagram,
        label=f"{renderer}, {precision}, {per_side**2} per pixel",
        renderer=renderer,
        variant="",
        precision=precision,
        samples=per_side**2,
        kind="right" if renderer == "tracer" else "reference",
        clock=clock,
        error=error,
        error_interval=interval,
        natural=float(np.sqrt(((image - truth) ** 2).mean())),
        unit="W/(m^2 sr)",
        wrong=0.0,
    )


def _traced(scene: Scene, configuration: Configuration, per_side: int) -> float:
    """Return the seconds of one launch of the tracer with one ray per sample."""
    finer = replace(
        scene,
        camera=replace(scene.camera, width=scene.camera.width * per_side, height=scene.camera.height * per_side),
    )
    return launch(finer, [Stage.RADIANCE], configuration)[0]


def _mitsuba(variant: str, scene: Scene, per_side: int, clock: str) -> Launch:
    """Return a launch of Mitsuba's own renderer on a scene that is loaded now, not in the launch."""
    camera = scene.camera
    world = load_scene(program.switch_to(variant), scene, near=camera.near, far=camera.far, samples=per_side)

    def once() -> float:
        program.switch_to(variant)
        seconds = kernel_seconds if clock == "kernels" else wall_seconds
        return seconds(lambda: radiance_image(world, scene, world.loaded.integrator(), per_side))

    return once


# The measurement of all diagrams: first all errors, then all launches, interleaved over all diagrams.


SAMPLES = "samples"
KINDS = {SAMPLES: "samples", LADDER: "ladders"}  # by the first part of a diagram's name; any other part is a slot
BUDGET = 0.6  # s of launches per point
AXES = {
    "formulas": ("ns per ray", "p99 of |dt| / (K u32)"),
    "ladders": ("ns per ray", "p99 of error / (K u32)"),
    "samples": ("ns per pixel", "RMSE of radiance over its mean"),
}


def overall(points: Sequence[TradeoffPoint], group: str) -> list[TradeoffPoint]:
    """Return one point per label that all diagrams of the group have: its geometric means over the diagrams.

    The mean error is NaN if in some diagram no pixel is decided rightly.
    """
    members = [point for point in points if point.diagram.split("/")[0] == group]
    diagrams = {point.diagram for point in members}
    means = []
    for label in dict.fromkeys(point.label for point in members):
        same = [point for point in members if point.label == label]
        if len(same) < len(diagrams):
            continue
        means.append(
            replace(
                same[0],
                diagram=f"{group}/overall",
                nanoseconds=_mean([point.nanoseconds for point in same]),
                nanoseconds_interval=_means([point.nanoseconds_interval for point in same]),
                error=_mean([point.error for point in same]),
                error_interval=_means([point.error_interval for point in same]),
                natural=None,
                wrong=float(np.mean([point.wrong for point in same])),
            )
        )
    return means


def _mean(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def _means(intervals: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the geometric means of the bounds; this interval is never narrower than the interval of the mean."""
    return _mean([low for low, _ in intervals]), _mean([high for _, high in intervals])


def measure(
    formulas: Sequence[Task],
    sampled: Sequence[tuple[str, Scene]],
    climbed: Sequence[Ladder],
    *,
    repetitions: int,
    tell: Callable[[str], None],
    named: Sequence[Formula] = (),
) -> TradeoffRecord:
    """Return all points and diagrams as docs/compare.md describes them.

    If `named` is not empty, diagrams of ladders show only these formulas and the defaults of their slots.
    """
    start = time.monotonic()
    ready = [entry for task in formulas for entry in entries(task, tell)]
    for family, scene in sampled:
        ready += sampling_entries(f"{SAMPLES}/{family}", scene, tell)
    ready += [entry for ladder in climbed for entry in ladder_entries(ladder, tell, named)]
    tell(f"run times of {len(ready)} points")
    seconds = interleave([entry.launch for entry in ready], repetitions=repetitions, budget=BUDGET)
    points = [entry.timed(times) for entry, times in zip(ready, seconds, strict=True)]
    for group in dict.fromkeys(point.diagram.split("/")[0] for point in points):
        if group != LADDER and len({point.diagram for point in points if point.diagram.split("/")[0] == group}) > 1:
            points += overall(points, group)
    return {
        "schema": SCHEMA,
        "environment": versions(),
        "origin": origin(SEED),
        "repetitions": repetitions,
        "seconds": round(time.monotonic() - start, 3),
        "diagrams": [_diagram(points, name) for name in dict.fromkeys(point.diagram for point in points)],
    }


def _diagram(points: Sequence[TradeoffPoint], name: str) -> DiagramRecord:
    members = [point for point in points if point.diagram == name]
    ahead = front(members)
    kind = KINDS.get(name.split("/")[0], "formulas")
    time_axis, error_axis = AXES[kind]
    return {
        "name": name,
        "kind": kind,
        "svg": f"{name.replace('/', '-')}.svg",
        "time_axis": time_axis,
        "error_axis": error_axis,
        "front": [point.label for point in ahead],
        "points": [point_record(point, on_front=point in ahead) for point in members],
    }
