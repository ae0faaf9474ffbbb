"""What Embree cannot answer, in sentences."""

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.embree.facets import facets

# Embree gets lengths over the largest coordinate; an eye or a light farther out than this many of those is beyond
# what it takes, and squares of lengths out of these bounds leave float64 beside it.
FARTHEST = 1e15
SMALLEST, LARGEST = 1e-140, 1e140  # m
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
    corners = np.abs(facets(scene).corners)
    size = float(corners.max(initial=0.0))
    lights = [float(np.abs(np.subtract(light.position, scene.camera.eye)).max()) for light in scene.lights]
    if size and not SMALLEST < size < LARGEST:
        return f"Squares of lengths of {size:g} m leave the range of the numbers that Embree's hits are continued in."
    if size and max(lights, default=0.0) > FARTHEST * size:
        return f"Embree's float32 does not reach a light at {max(lights):g} m from shapes within {size:g} m of the eye."
    return None
