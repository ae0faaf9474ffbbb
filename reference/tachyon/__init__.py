"""Tachyon: the reference's class, and which scenes it refuses."""

from collections.abc import Collection
from functools import lru_cache

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Scene, Sphere, is_similarity
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reference.tachyon import program
from rayproof.reference.tachyon.program import EPSILON, missing
from rayproof.reference.tachyon.scene import Facets, cut, one_sided_from_behind, surface_of

ANSWERED = (Stage.OBJECT, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
# Triangles of twice this area are missed at less than half a degree from their plane, smaller ones at more.
SMALLEST = 100 * EPSILON  # m^2, of the parallelogram
# Hits within EPSILON of a feeler's start are ignored; from here on rounding lies beyond it.
LARGEST = 1e4  # m


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Tachyon cannot answer `stage` of `scene`, or None if it can."""
    if stage not in ANSWERED:
        return "Tachyon shows pictures only: which surface, and how much light."
    return missing() or _shapes(scene) or _clipping(scene) or _backs(scene, stage)


@lru_cache(maxsize=4)
def _shapes(scene: Scene) -> str | None:
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Sphere) and not is_similarity(shape.to_world):
            return f"Tachyon has spheres but no ellipsoids, and shapes[{index}] is one."
        surface = surface_of(shape)
        if isinstance(surface, Facets) and len(surface.corners):
            first, second = (surface.corners[:, corner] - surface.corners[:, 0] for corner in (1, 2))
            area = float(np.linalg.norm(np.cross(first, second), axis=1).min()) / 2
            if 2 * area < SMALLEST:
                return f"Tachyon may miss triangles as small as one of shapes[{index}], {area:.1g} m^2."
            if (reach := float(np.abs(surface.corners).max())) > LARGEST:
                return f"Tachyon's tolerances are below float64's rounding at {reach:.1g} m, where shapes[{index}] is."
    return None


@lru_cache(maxsize=4)
def _clipping(scene: Scene) -> str | None:
    found = cut(scene)
    return found and f"Tachyon's clipping cuts shadows too, and the camera's may cut {found}."


def _backs(scene: Scene, stage: Stage) -> str | None:
    if stage in (Stage.OBJECT, Stage.RADIANCE):
        return None
    found = one_sided_from_behind(scene)
    return found and f"Tachyon turns every normal towards the viewer, and {found} is one-sided and may show its back."


# Tachyon as a reference: a renderer of 1994 that answers in pictures, and so is asked in colours.


class Tachyon:
    """An independent camera, hits, shadows and light of spheres, planes and triangles.

    It computes in float64, on a scene that it reads as float32. Object and visibility are integers; light has the steps
    of 16-bit pictures at several exposures. Irradiance is what the scene reflects when all of it is white, exitance
    that times albedo.
    """

    precision = "float32"
    ray_epsilon = program.EPSILON

    @classmethod
    def missing(cls) -> str | None:
        """Return how to install Tachyon, or None if it is there."""
        return program.missing()

    def version(self) -> str:
        """Return program and version."""
        return program.version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        return {"options": " ".join(program.OPTIONS)}

    def resolution(self, scene: Scene, stage: Stage) -> Resolution | None:
        """Return half a step of the pictures, where the answer is a quantity of light."""
        if stage not in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
            return None
        from rayproof.reference.tachyon.program import LADDER

        # A value fills at least a quarter of the range, and Tachyon's colours are float32.
        steps = program.WHITE / LADDER - 1
        return Resolution(
            relative=0.5 / steps + gamma(16, precision="float32"),
            absolute=0.0,
            because="16-bit pictures at exposures that grow fourfold, and colours in float32",
        )

    def epsilon_at(self, seen: StageImages) -> float:
        """Return how near [m] to a feeler's start Tachyon ignores what blocks it."""
        return self.ray_epsilon

    def notes(self, scene: Scene) -> list[str]:
        """Return in sentences where Tachyon's answer is to another question than the one asked."""
        return ["Irradiance is pi times the radiance of the scene painted white."] if scene.lights else []

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel."""
        from rayproof.reference.tachyon import program
        from rayproof.reference.tachyon.scene import model

        camera, images = scene.camera, StageImages()
        if {Stage.OBJECT, Stage.EXITANCE} & set(stages):
            images[Stage.OBJECT] = program.faces(
                program.picture(model(scene, program.numbered), camera.width, camera.height)
            )
        if Stage.VISIBILITY in stages:
            seen = [program.visible(scene, program.white, each) for each in scene.lights]
            none = np.zeros((camera.height, camera.width, 0))
            images[Stage.VISIBILITY] = np.stack(seen, axis=-1).astype(np.float64) if seen else none
        if {Stage.IRRADIANCE, Stage.EXITANCE} & set(stages):
            factor = np.pi if scene.shading == "inverse_square" else 1.0
            images[Stage.IRRADIANCE] = factor * program.radiance(scene, program.white, 1)
        if Stage.EXITANCE in stages:
            albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
            images[Stage.EXITANCE] = albedo[images[Stage.OBJECT][..., 0].astype(int)] * images[Stage.IRRADIANCE]
        if Stage.RADIANCE in stages:
            images[Stage.RADIANCE] = program.radiance(scene, program.diffuse(scene), samples)
        return {stage: images[stage] for stage in stages}
