"""Tachyon as a reference: a renderer of 1994 that answers in pictures, and so is asked in colours."""

from collections.abc import Collection

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reference.tachyon import program


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
        from rayproof.reference.tachyon.refusals import refusal

        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        return {"options": " ".join(program.OPTIONS)}

    def resolution(self, scene: Scene, stage: Stage) -> Resolution | None:
        """Return half a step of the pictures, where the answer is a quantity of light."""
        if stage not in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
            return None
        from rayproof.reference.tachyon.light import LADDER

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
        from rayproof.reference.tachyon import light, paints
        from rayproof.reference.tachyon.models import model

        camera, found = scene.camera, StageImages()
        if {Stage.OBJECT, Stage.EXITANCE} & set(stages):
            found[Stage.OBJECT] = paints.faces(
                program.picture(model(scene, paints.numbered), camera.width, camera.height)
            )
        if Stage.VISIBILITY in stages:
            seen = [light.visible(scene, paints.white, each) for each in scene.lights]
            none = np.zeros((camera.height, camera.width, 0))
            found[Stage.VISIBILITY] = np.stack(seen, axis=-1).astype(np.float64) if seen else none
        if {Stage.IRRADIANCE, Stage.EXITANCE} & set(stages):
            factor = np.pi if scene.shading == "inverse_square" else 1.0
            found[Stage.IRRADIANCE] = factor * light.radiance(scene, paints.white, 1)
        if Stage.EXITANCE in stages:
            albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
            found[Stage.EXITANCE] = albedo[found[Stage.OBJECT][..., 0].astype(int)] * found[Stage.IRRADIANCE]
        if Stage.RADIANCE in stages:
            found[Stage.RADIANCE] = light.radiance(scene, paints.diffuse(scene), samples)
        return {stage: found[stage] for stage in stages}
