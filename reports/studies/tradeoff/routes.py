"""Diagrams of routes: the same image by stages, by numbers in memory, by literals, by a frozen kernel.

The image that is timed is the one whose error is taken: a larger image may be traced by another plan. What a route
declares is counted (`FOLDED`): no bit beside the stages of its precision, or so many
roundings of full light. A pixel beyond that is a wrong one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import drjit as dr
import numpy as np

from rayproof.cases.rounding import PRECISIONS, UNIT_ROUNDOFF, gamma
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reference.double_double import DoubleDouble
from rayproof.reports.studies.compare.paired_errors import enlarged
from rayproof.reports.studies.compare.records import as_received
from rayproof.reports.studies.tradeoff.formulas import pixels
from rayproof.reports.studies.tradeoff.points import Entry, Point, kernel_seconds, quantile, tail
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.kernel.parameters import LITERALS
from rayproof.tracer.light_path import Trace, images
from rayproof.tracer.render import render

# Literals fold: a division by one becomes a product with its reciprocal, a product or a root of two is the host's. It
# concerns three roundings of a normal and three of light, each of which is another one on either side.
FOLDED = 2 * (3 + 3)
ROUTES = "paths"  # the first half of a diagram's name
RAYS = 2**17  # from here on a lane takes several samples, as in the images that somebody waits for
FEW = 2**12  # where only the slow oracle knows the truth
SHOWN = 2**13  # pixels, evenly spread, from which a tail and its interval are estimated


@dataclass(frozen=True, kw_only=True)
class Way:
    """A route: the image that it makes again and again, and how many roundings of full light it may be off by."""

    name: str
    image: Callable[[], np.ndarray]  # (height, width, 3)
    run: Callable[[], object]  # the kernels of `image` alone
    roundings: int


def ways(scene: Scene, configuration: Configuration) -> tuple[Way, ...]:
    """Return every route by which an image of one sample a pixel is made."""
    frames = Frames(scene, configuration)
    stages = partial(render, scene, IMAGE_STAGES, configuration)
    alone = partial(render, scene, (Stage.RADIANCE,), configuration)
    literals = partial(_by_literals, scene, configuration)
    return (
        Way(name="stages", image=lambda: stages()[Stage.RADIANCE], run=stages, roundings=0),
        Way(name="numbers", image=lambda: alone()[Stage.RADIANCE], run=alone, roundings=0),
        Way(name="literals", image=literals, run=literals, roundings=FOLDED),
        Way(name="frames", image=lambda: frames.pixels().astype(np.float64), run=frames, roundings=FOLDED),
    )


def _by_literals(scene: Scene, configuration: Configuration) -> np.ndarray:
    trace = Trace.of(scene, configuration, per_side=1, parameters=LITERALS)
    samples = images(trace, (Stage.RADIANCE,))[Stage.RADIANCE]
    dr.eval(samples)
    lanes = trace.view.lanes
    found = [lanes.image([np.array(channel, dtype=np.float64) for channel in of]) for of in zip(*samples, strict=True)]
    return np.stack(found, axis=-1)


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


def route_entries(diagram: str, scene: Scene, tell: Callable[[str], None]) -> list[Entry]:
    """Return the points of one diagram, measured and ready to be timed."""
    tell(f"{diagram}: routes")
    scene = as_received(scene)
    exact = DoubleDouble().unsupported(scene, Stage.RADIANCE) is None
    large = enlarged(scene, RAYS if exact else FEW)
    oracle = DoubleDouble() if exact else Analytic()
    truth = oracle.render(large, [Stage.OBJECT, Stage.RADIANCE])
    found = []
    for precision in PRECISIONS:
        configuration = Configuration(precision=precision)
        judged = render(large, IMAGE_STAGES, configuration)
        light = full_light(large, judged)
        # On an outline the other object is seen, and no rounding of light is meant.
        same = np.all(judged[Stage.OBJECT] == truth[Stage.OBJECT], axis=-1)
        for way in ways(large, configuration):
            image = way.image()
            beyond = abs(image - judged[Stage.RADIANCE]) > gamma(way.roundings, precision=precision) * light
            off = _off(image, truth[Stage.RADIANCE], light, same)
            error, interval = tail([off[:: max(1, len(off) // SHOWN)]])
            point = Point(
                diagram=diagram,
                label=f"{way.name}, {precision}",
                renderer="tracer",
                variant=way.name,
                precision=precision,
                samples=1,
                kind="right",
                clock="kernels",
                error=error,
                error_interval=interval,
                natural=quantile([off * UNIT_ROUNDOFF["float32"]]),
                unit="of full light",
                wrong=float(np.mean(beyond.any(axis=-1) | ~np.isfinite(image).all(axis=-1))),
            )
            found.append(Entry(point=point, launch=partial(kernel_seconds, way.run), rays=pixels(large)))
    return found


def _off(image: np.ndarray, truth: np.ndarray, light: np.ndarray, same: np.ndarray) -> np.ndarray:
    """Return each pixel's error in roundings of float32 of full light, (pixels,); NaN where nothing is lit or meant."""
    with np.errstate(invalid="ignore", divide="ignore"):
        off = abs(image - truth) / (light * UNIT_ROUNDOFF["float32"])
    off = np.where((light > 0) & same[..., np.newaxis], off, np.nan)
    return np.where(np.isnan(off).all(axis=-1), np.nan, np.nan_to_num(off).max(axis=-1)).ravel()
