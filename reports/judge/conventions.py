"""Test of other conventions (clip, side, pixel point, one light at random) as explanations of an outlier.

A convention is another meaning of the scene: another clip mode, another lit side, another point of the pixel, or a
randomly chosen light. The oracle computes the answers under this convention, with their own limits, and the renderer is
judged against them as strictly as against the right ones. A convention explains a renderer only if the renderer passes.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.checks import measured
from rayproof.reports.judge.measurement import jsonable
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.results.case_records import ConventionRecord

CLIPS = {
    "depth": "clips at the near and far planes",
    "shell": "clips at spheres around the eye (near < t < far)",
    "none": "clips nothing",
}
CORNERS = {
    (0, 0): "samples each pixel at its top left corner",
    (0, 1): "samples each pixel at its top right corner",
    (1, 0): "samples each pixel at its bottom left corner",
    (1, 1): "samples each pixel at its bottom right corner",
}
HOPELESS = 0.05  # of the pixels over their limits: no nearby problem explains so many
LIT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@dataclass(frozen=True, kw_only=True)
class Tested:
    """One convention and the result of its test."""

    what: str  # a verb phrase with the renderer as its subject
    ratio: float  # worst error over limit under it
    differing: int  # pixels over the limit under it that no nearby problem explains
    interior: int  # pixels within their limits under it

    @property
    def explains(self) -> bool:
        """Return whether this convention explains the renderer's answer completely."""
        return self.ratio <= 1 and self.interior > 0

    def as_json(self) -> ConventionRecord:
        """Return plain JSON data."""
        return {
            "what": self.what,
            "explains": self.explains,
            "ratio": jsonable(self.ratio),
            "differing": self.differing,
            "interior": self.interior,
        }


def tested(scene: Scene, judged: AgainstOracle, stage: Stage, oracle: Analytic) -> list[Tested]:
    """Return every known convention that could matter to the scene, tested at one image stage of the renderer."""
    renderer = judged.renderer
    if stage not in IMAGE_STAGES or renderer.error is not None or stage not in renderer.answers:
        return []
    truth = cache(lambda other_scene: scene_truth(other_scene, stages_of(other_scene), oracle, known={}))
    wrong = judged.over(stage) if judged.answers(stage) else np.zeros_like(judged.base.conditioning.hit)
    results = [
        _under(what, truth(other_scene), renderer, stage, moved, wrong)
        for what, other_scene, moved in _questions(scene)
    ]
    if stage in LIT and len(scene.lights) > 1:
        results.append(_one_light(scene, renderer, stage, oracle))
    return results


Moved = Callable[[StageImages, StageImages], StageImages]


def _questions(scene: Scene) -> Iterator[tuple[str, Scene, Moved | None]]:
    """Yield conventions as other scenes; for pixel corners also a function that inserts the renderer's image."""
    for clip, what in CLIPS.items():
        if clip != scene.clip:
            yield what, replace(scene, clip=clip), None
    for two_sided, what in ((True, "lights and turns both sides of every surface"), (False, "lights outer sides only")):
        if any(shape.two_sided != two_sided for shape in scene.shapes):
            yield (
                what,
                replace(scene, shapes=tuple(replace(shape, two_sided=two_sided) for shape in scene.shapes)),
                None,
            )
    camera = scene.camera
    # One more row and column of pixels of the same size: their centres are the pixel corners of the original image.
    fovy = math.degrees(2 * math.atan(math.tan(camera.alpha) * (camera.height + 1) / camera.height))
    if fovy < 180:
        larger = replace(camera, width=camera.width + 1, height=camera.height + 1, fovy=fovy)
        for (down, right), what in CORNERS.items():
            yield what, replace(scene, camera=larger), _placed(down, right)


def _placed(down: int, right: int) -> Moved:
    """Return the function that inserts the answers of a smaller image into those of a larger image."""

    def moved(images: StageImages, whole: StageImages) -> StageImages:
        laid: StageImages = {}
        for stage, image in images.items():
            if stage in IMAGE_STAGES and stage in whole:
                laid[stage] = np.array(whole[stage], dtype=np.float64)
                height, width = np.shape(image)[:2]
                laid[stage][down : down + height, right : right + width] = image
        return laid

    return moved


def _under(
    what: str, base: SceneTruth, renderer: Answers, stage: Stage, moved: Moved | None, wrong: np.ndarray
) -> Tested:
    """Judge the renderer against the oracle's answer under a convention."""
    subject = renderer
    if moved is not None:
        subject = replace(renderer, answers=moved(renderer.answers, base.truth), shadow_epsilon=_most(renderer))
    against = AgainstOracle(base, replace(subject, answers={stage: subject.answers[stage]}))
    if not against.answers(stage):
        return Tested(what=what, ratio=math.inf, differing=0, interior=0)
    over = against.over(stage)
    unmoved = moved is None and np.count_nonzero(over & wrong) > np.count_nonzero(wrong) / 2
    if unmoved or over.mean() > HOPELESS:
        # Nearby problems explain few pixels, and none for a convention that leaves most of the wrong pixels unchanged.
        ratio = float(against.ratio(stage).max())
        return Tested(what=what, ratio=ratio, differing=int(np.count_nonzero(over)), interior=int(np.sum(~over)))
    numbers = measured(against, against.end_to_end[stage])
    return Tested(what=what, ratio=numbers.worst_ratio, differing=numbers.wrong, interior=numbers.interior)


def _one_light(scene: Scene, renderer: Answers, stage: Stage, oracle: Analytic) -> Tested:
    """Judge each pixel of the renderer against each single light, multiplied by the number of lights."""
    ratios_by_light = []
    for light in scene.lights:
        red, green, blue = (len(scene.lights) * flux for flux in light.flux)
        single_light_scene = replace(scene, lights=(replace(light, flux=(red, green, blue)),))
        base = scene_truth(single_light_scene, stages_of(single_light_scene), oracle, known={})
        subject = replace(renderer, answers={stage: renderer.answers[stage]}, shadow_epsilon=_most(renderer))
        ratios_by_light.append(np.where(base.beside_changes, 0.0, AgainstOracle(base, subject).ratio(stage)))
    best = np.min(ratios_by_light, axis=0)
    return Tested(
        what="picks one light at random in each pixel",
        ratio=float(best.max()),
        differing=int(np.count_nonzero(best > 1)),
        interior=best.size,
    )


def _most(renderer: Answers) -> float:
    """Return the largest of a renderer's shadow epsilons, for an image with different pixels."""
    return float(np.max(renderer.shadow_epsilon))


def in_words(results: Sequence[Tested]) -> str:
    """Return the results of the tests as the end of a sentence about the renderer."""
    if not results:
        return ""
    explaining = [result.what for result in results if result.explains]
    if explaining:
        return f" Explained: its answers are those of a renderer that {', or '.join(explaining)}."
    return f" Not explained by any of {len(results)} conventions tested."
