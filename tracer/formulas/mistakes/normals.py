"""Planted mistakes of normals in object space and in world space, and of the visible side."""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.shapes.shape import Transform


def fault_greatest_value(point: Any) -> Any:
    """Return the signed axis of the greatest value.

    The greatest coordinate taken in place of the greatest magnitude.
    """
    along_x = (point.x >= point.y) & (point.x >= point.z)
    along_y = ~along_x & (point.y >= point.z)
    along_z = ~along_x & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )


def fault_other_tie(point: Any) -> Any:
    """Return the outward axis, ties the other way round.

    A tie on an edge decided z before y before x (erratum E8).
    """
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_z = (z >= x) & (z >= y)
    along_y = ~along_z & (y >= x)
    along_x = ~along_z & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )


def fault_unsigned(point: Any) -> Any:
    """Return the axis of the greatest coordinate, always positive.

    The sign of the cube's normal lost.
    """
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_x = (x >= y) & (x >= z)
    along_y = ~along_x & (y >= z)
    return type(point)(dr.select(along_x, 1.0, 0), dr.select(along_y, 1.0, 0), dr.select(along_x | along_y, 0, 1.0))


def fault_away(normal: Any, direction: Any) -> Any:
    """Return the normal turned along the ray.

    The normal of a two-sided surface turned away from the viewer.
    """
    return dr.select(dr.dot(normal, direction) < 0, -normal, normal)


def fault_never(normal: Any, direction: Any) -> Any:
    """Return the outward normal.

    The normal of a two-sided surface never turned towards the viewer.
    """
    return normal


def fault_inward(point: Any, center: Any) -> Any:
    """Return normalize(center - point).

    The sphere's normal turned inwards.
    """
    return dr.normalize(center - point)


def fault_unnormalised(point: Any, center: Any) -> Any:
    """Return point - center.

    Point minus centre left as long as the radius.
    """
    return point - center


def fault_inverse_untransposed(normal: Any, transform: Transform) -> Any:
    """Return the inverse matrix times the normal, renormalised.

    The inverse used without its transpose.
    """
    return dr.normalize(transform.vector_to_object(normal))


def fault_model_matrix(normal: Any, transform: Transform) -> Any:
    """Return the model matrix times the normal, renormalised.

    The normal taken to world space as if it were a direction.
    """
    return dr.normalize(transform.vector_to_world(normal))


def fault_world_normal_unnormalised(normal: Any, transform: Transform) -> Any:
    """Return the inverse transpose times the normal, of whatever length.

    The world normal not renormalised.
    """
    return transform.normal_to_world(normal)


def fault_world_winding(normal: Any, transform: Transform) -> Any:
    """Return the world normal, inward under a mirror.

    The normal taken from world-space winding, which a mirror turns round.
    """
    side = float(np.sign(np.linalg.det(transform.linear)))
    return dr.normalize(transform.normal_to_world(normal)) * side
