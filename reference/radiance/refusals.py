"""What rtrace cannot answer, in sentences."""

from functools import lru_cache

from rayproof.cases.scene import Plane, Scene, Sphere, is_similarity
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.radiance.extents import FTINY, box, extent, height, reach, scale

# Among the images; the ray itself needs no shape.
HIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.OBJECT) :]
LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
# What rtrace overlooks at a ray's start may be at most this fraction of a shape.
COARSEST = 0.01
# Coordinates beyond lose their unit's power of two or overflow where they are squared.
LARGEST, SMALLEST = 1e140, 1e-140


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Radiance cannot answer `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "rtrace has no camera: it is handed rays."
    size = extent(scene)
    if not SMALLEST < size < LARGEST:
        return f"Squares of lengths of {size:g} m leave the range of rtrace's numbers."
    if stage in HIT:
        reason = _shapes(scene)
        if reason is not None:
            return reason
    if stage in LIT and stage is not Stage.VISIBILITY and scene.shading == "simplified":
        return "Radiance has no light without the inverse square law."
    return _horizon(scene) if stage in LIT else None


def _horizon(scene: Scene) -> str | None:
    """Return why nothing is said of light where a plane is seen so far off that a light stands too low over it."""
    planes = [(index, shape) for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)]
    for index, plane in planes:
        for number, light in enumerate(scene.lights):
            above = abs(height(plane, light.position)[0])
            if 0 < above <= 2 * FTINY * reach(scene):
                return (
                    f"rtrace takes cosines below 1e-6 for 0; light {number} has such on far parts of shapes[{index}]."
                )
    return None


@lru_cache(maxsize=4)
def _shapes(scene: Scene) -> str | None:
    least = FTINY / COARSEST / scale(scene)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Sphere) and not is_similarity(shape.to_world):
            return f"Radiance has no ellipsoids, and shapes[{index}] is one."
        if isinstance(shape, Plane):
            continue
        low, high = box(shape)
        if float((high - low).max()) < least:
            return f"rtrace resolves {least:g} m in a scene of this size, and shapes[{index}] is smaller."
    return None
