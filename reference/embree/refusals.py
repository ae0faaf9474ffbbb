"""What Embree cannot answer, in sentences."""

import numpy as np

from cases.scene import Cube, Mesh, Scene, Square, Triangle
from cases.stages import Stage
from reference.embree.facets import facets

# Embree ignores geometry with coordinates above 1.8e18; half the digits of that are room for products.
LARGEST = 1e15  # m
GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Embree cannot answer `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "Embree has no camera: it is handed rays."
    if stage is Stage.RAY:
        return None
    if stage not in GEOMETRY:
        return "Embree finds hits and blockers; it knows no light."
    for index, shape in enumerate(scene.shapes):
        if not isinstance(shape, Triangle | Mesh | Square | Cube):
            return f"Embree is asked about triangles alone, and shapes[{index}] is a {type(shape).__name__.lower()}."
    lights = [np.subtract(light.position, scene.camera.eye) for light in scene.lights]
    largest = max(
        (float(np.abs(points).max()) for points in (*lights, facets(scene).corners) if points.size), default=0.0
    )
    return None if largest <= LARGEST else f"Embree's float32 does not reach {largest:g} m from the eye."
