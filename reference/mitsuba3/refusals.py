"""What Mitsuba cannot answer, in sentences."""

from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.mitsuba3.epsilons import offsets
from rayproof.reference.mitsuba3.extents import box, distances_from, finite_shapes
from rayproof.reference.mitsuba3.planes import reach

LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
# Embree ignores geometry with coordinates above 1.8e18, and the determinant of a disc's matrix must fit float32.
LARGEST = 1e15  # m
# Feelers that start higher above a shape than this fraction of its size no longer test its shadow.
COARSEST_OFFSET = 0.01


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Mitsuba cannot answer `stage` of `scene`, or None if it can."""
    return _size(scene) or (_light(scene, stage) if stage in LIT else None)


@lru_cache(maxsize=4)
def _size(scene: Scene) -> str | None:
    boxes = [corner for _, shape in finite_shapes(scene) for corner in box(shape)]
    points = np.array([scene.camera.eye, *(light.position for light in scene.lights), *boxes])
    largest = max(float(np.abs(points).max()), reach(scene))
    return f"Mitsuba's float32 does not reach {largest:g} m." if largest > LARGEST else None


def _light(scene: Scene, stage: Stage) -> str | None:
    for index, shape in finite_shapes(scene):
        low, high = box(shape)
        size, offset = float((high - low).max()), float(offsets(np.stack([low, high])).max())
        if scene.lights and offset > COARSEST_OFFSET * size:
            return f"Mitsuba's feelers start {offset:g} m above shapes[{index}], which measures only {size:g} m."
    if stage is Stage.VISIBILITY:
        return None
    if scene.shading == "simplified":
        return "Mitsuba has no light without the inverse square law."
    return _image(scene) if stage is Stage.RADIANCE else None


def _image(scene: Scene) -> str | None:
    for index, shape in enumerate(scene.shapes):
        if max(shape.albedo) > 1:
            return f"Mitsuba refuses an albedo above 1, shapes[{index}] has {shape.albedo}."
    if scene.clip == "shell" and not _inside_shell(scene):
        return "Mitsuba's camera clips at planes, not at spheres around the eye."
    return None


def _inside_shell(scene: Scene) -> bool:
    """Return whether every shape surely lies between the two spheres, so that they clip nothing."""
    finite = finite_shapes(scene)
    bounds = [distances_from(scene.camera.eye, shape) for _, shape in finite]
    camera = scene.camera
    return len(finite) == len(scene.shapes) and all(camera.near < n and f < camera.far for n, f in bounds)
