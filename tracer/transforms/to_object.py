"""A ray into object space."""

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.transforms import Transform
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register("to_object/inverse", covers=("XF-1",), kind="right", stage=Stage.OBJECT, default=True)
def to_object(ray: Ray, transform: Transform) -> Ray:
    """Return the ray by the inverse model matrix; the direction is not renormalised, so t keeps its meaning."""
    return Ray(origin=transform.point_to_object(ray.origin), direction=transform.vector_to_object(ray.direction))
