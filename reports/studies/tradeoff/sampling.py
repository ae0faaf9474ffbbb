"""Diagrams of samples per pixel: box-filtered radiance against the analytic coverage, our tracer's and Mitsuba's."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.mitsuba3 import MitsubaLlvm, MitsubaScalar, program
from rayproof.reference.mitsuba3.program import radiance_image
from rayproof.reference.mitsuba3.scene import load_scene
from rayproof.reports.studies.compare.timing import enlarged, launch
from rayproof.reports.studies.tradeoff.clocks import Launch, kernel_seconds, wall_seconds
from rayproof.reports.studies.tradeoff.entry import Entry
from rayproof.reports.studies.tradeoff.formulas import pixels
from rayproof.reports.studies.tradeoff.points import Point
from rayproof.reports.studies.tradeoff.tails import root_mean_square
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render

PER_SIDE = (1, 2, 4, 8)  # 1, 4, 16, 64 samples per pixel
# The truth's own sampling error falls as 1 / samples per side (an outline crosses that many cells): four times below 8.
TRUTH_PER_SIDE = 32
WIDEST = 24  # px: the truth takes a thousand rays a pixel
SAMPLES_TIMED = 2**18  # rays in a launch of the tracer
SAMPLES_WALL = 2**16


def small(scene: Scene) -> Scene:
    """Return the scene in at most WIDEST pixels a side, with the same view."""
    camera = scene.camera
    shrink = min(1.0, WIDEST / max(camera.width, camera.height))
    width, height = (max(1, round(size * shrink)) for size in (camera.width, camera.height))
    return replace(scene, camera=replace(camera, width=width, height=height))


def sampling_entries(diagram: str, scene: Scene, tell: Callable[[str], None]) -> list[Entry]:
    """Return the points of one diagram, measured and ready to be timed; a time is that of a pixel."""
    tell(f"{diagram}: samples per pixel")
    asked = small(scene)
    truth = Analytic().render(asked, [Stage.RADIANCE], samples=TRUTH_PER_SIDE)[Stage.RADIANCE]
    found = []
    for precision in PRECISIONS:
        one = Configuration(precision=precision)
        for per_side in PER_SIDE:
            large = enlarged(asked, SAMPLES_TIMED / per_side**2)
            image = render(asked, [Stage.RADIANCE], one, samples=per_side)[Stage.RADIANCE]
            found.append(
                Entry(
                    point=_point(diagram, "tracer", precision, per_side, "kernels", image, truth),
                    launch=partial(_traced, large, one, per_side),
                    rays=pixels(large),
                )
            )
    for name, kind in (("mitsuba_llvm", MitsubaLlvm), ("mitsuba_scalar", MitsubaScalar)):
        reference = kind()
        # Mitsuba's own camera clips at planes; other modes would time another image.
        if asked.clip != "depth" or reference.unsupported(asked, Stage.RADIANCE) is not None:
            continue
        clock = "kernels" if kind is MitsubaLlvm else "wall"
        for per_side in PER_SIDE:
            large = enlarged(asked, SAMPLES_WALL / per_side**2)
            image = reference.render(asked, [Stage.RADIANCE], samples=per_side)[Stage.RADIANCE]
            found.append(
                Entry(
                    point=_point(diagram, name, "float32", per_side, clock, image, truth),
                    launch=_mitsuba(kind.variant, large, per_side, clock),
                    rays=pixels(large),
                )
            )
    return found


def _point(
    diagram: str, renderer: str, precision: str, per_side: int, clock: str, image: np.ndarray, truth: np.ndarray
) -> Point:
    error, interval = root_mean_square(image, truth)
    return Point(
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
    """Return the seconds of one launch of as many rays as the samples have."""
    finer = replace(
        scene,
        camera=replace(scene.camera, width=scene.camera.width * per_side, height=scene.camera.height * per_side),
    )
    return launch(finer, [Stage.RADIANCE], configuration)[0]


def _mitsuba(variant: str, scene: Scene, per_side: int, clock: str) -> Launch:
    """Return a launch of Mitsuba's own renderer on a scene that it has loaded already."""
    camera = scene.camera
    world = load_scene(program.switch_to(variant), scene, near=camera.near, far=camera.far, samples=per_side)

    def once() -> float:
        program.switch_to(variant)
        seconds = kernel_seconds if clock == "kernels" else wall_seconds
        return seconds(lambda: radiance_image(world, scene, world.loaded.integrator(), per_side))

    return once
