"""What Cycles cannot answer, in sentences."""

import math

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.cycles.program import missing
from rayproof.reference.cycles.surfaces import Ball, surface_of

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
