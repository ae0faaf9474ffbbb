"""Cycles, Blender's path tracer, as a reference: pictures with position, normal and numbers beside the light."""

from collections.abc import Collection

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.cycles import program


class Cycles:
    """A production renderer in float32, with a camera, geometry, shadows and light of its own, in its own process."""

    precision = "float32"

    @classmethod
    def missing(cls) -> str | None:
        """Return how to install Cycles, or None if it is there."""
        return program.missing()

    def version(self) -> str:
        """Return program and version."""
        return program.version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        from rayproof.reference.cycles.refusals import refusal

        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.cycles import tasks

        return {name: str(value) for name, value in tasks.CYCLES.items()}

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        A picture per light: of several, a sample of Cycles takes one at random.
        """
        from rayproof.reference.cycles import tasks

        lights = range(len(scene.lights)) if Stage.RADIANCE in stages and scene.lights else (-1,)
        names = {f"{light}.exr": light for light in lights}
        with program.workshop() as folder:
            tasks.write(folder, scene, names, samples)
            program.render(folder)
            pictures = [tasks.read(folder / name) for name in names]
        found = _hits(scene, pictures[0])
        camera = scene.camera
        light = sum(tasks.pixels(picture, "Combined", "RGB") for picture in pictures)
        parts = np.reshape(light, (camera.height, samples, camera.width, samples, 3))
        found[Stage.RADIANCE] = parts.mean(axis=(1, 3))
        return {stage: found[stage] for stage in stages}


def _hits(scene: Scene, picture: dict[str, np.ndarray]) -> StageImages:
    """Return object, distance, position and normal."""
    from rayproof.reference.cycles import tasks

    shape = tasks.pixels(picture, "shape", "X") - 1
    hit = shape >= 0
    two_sided = np.array([*(each.two_sided for each in scene.shapes), False])[shape.astype(int)]
    position, shading = (np.where(hit, tasks.pixels(picture, name, "XYZ"), 0.0) for name in ("Position", "Normal"))
    # Cycles turns normals to the viewer, and says where it did.
    turned = (tasks.pixels(picture, "back", "X") > 0) & ~two_sided
    distance = np.linalg.norm(position - np.asarray(scene.camera.eye), axis=-1, keepdims=True)
    return {
        Stage.OBJECT: np.concatenate([shape, np.where(hit, tasks.pixels(picture, "face", "X"), -1.0)], axis=-1),
        Stage.DISTANCE: np.where(hit, distance, np.inf),
        Stage.POSITION: position,
        Stage.NORMAL: np.where(turned, -shading, shading),
    }
