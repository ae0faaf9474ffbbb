"""Blender's Cycles: the reference's class, and which scenes it refuses."""

import math
from collections.abc import Collection

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.cycles import program
from rayproof.reference.cycles.program import missing
from rayproof.reference.cycles.scene import Ball, surface_of

ANSWERED = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.RADIANCE)
# Blender's cameras keep their angle between these.
NARROWEST, WIDEST = 0.4, 170.0  # degrees
# Face numbers travel as float32.
MOST_FACES = 2**24


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Cycles cannot answer `stage` of `scene`, or None if it can."""
    if stage not in ANSWERED:
        return "Cycles shows what is hit, where, its normal and its radiance, and nothing in between."
    return missing() or _camera(scene) or _shapes(scene) or (_light(scene) if stage is Stage.RADIANCE else None)


def _camera(scene: Scene) -> str | None:
    if not NARROWEST <= scene.camera.fovy <= WIDEST:
        return f"Blender's cameras see between {NARROWEST:g} and {WIDEST:g} degrees, not {scene.camera.fovy:g}."
    if scene.clip == "shell":
        return "Cycles' camera clips at planes, not at spheres around the eye."
    return None


def _shapes(scene: Scene) -> str | None:
    camera = scene.camera
    # Rays begin on the near plane, and a point that holds their beginning is not hit.
    corner = math.hypot(1.0, math.tan(camera.alpha), math.tan(camera.alpha) * camera.aspect)
    start = camera.near * corner if scene.clip == "depth" else 0.0
    for index, shape in enumerate(scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, str):
            return f"Cycles has no such shape: shapes[{index}] {surface}."
        if isinstance(surface, Ball):
            if np.linalg.norm(surface.center - camera.eye) < surface.radius + start:
                return f"Cycles' spheres are not seen from inside, as shapes[{index}] is."
        elif surface.numbers.max(initial=0) >= MOST_FACES:
            return f"Cycles' numbers of faces are float32, too few for shapes[{index}]."
    return None


def _light(scene: Scene) -> str | None:
    if scene.shading == "simplified":
        return "Cycles has no light without the inverse square law."
    for index, shape in enumerate(scene.shapes):
        if max(shape.albedo) > 1:
            return f"Cycles conserves energy, and shapes[{index}] has an albedo above 1, {shape.albedo}."
    return None


# Cycles, Blender's path tracer, as a reference: pictures with position, normal and numbers beside the light.


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
        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.cycles import scene as tasks

        return {name: str(value) for name, value in tasks.CYCLES.items()}

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        A picture per light: of several, a sample of Cycles takes one at random.
        """
        from rayproof.reference.cycles import scene as tasks

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
    from rayproof.reference.cycles import scene as tasks

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
