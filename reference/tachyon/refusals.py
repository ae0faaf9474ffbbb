"""What Tachyon cannot answer, in sentences."""

from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Scene, Sphere, is_similarity
from rayproof.cases.stages import Stage
from rayproof.reference.tachyon.clips import cut
from rayproof.reference.tachyon.program import EPSILON, missing
from rayproof.reference.tachyon.sides import one_sided_from_behind
from rayproof.reference.tachyon.surfaces import Facets, surface_of

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
