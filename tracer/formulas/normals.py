"""Formulas of normals: in object space, carried to world space, and turned towards the viewer."""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.kernel.arithmetic import normalized, quad
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import HALF, Transform


def from_center(point: Any, center: Any) -> Any:
    """Return normalize(point - center).

    A sphere's normal in object space.
    """
    return normalized(point - center)


def center_kept(point: Any, center: Any) -> Any:
    """Return normalize(point), right only for a centre at the origin.

    Control for erratum E17: "normalize the point of intersection", a point and not a vector from the centre.
    """
    return dr.normalize(point)


def greatest(point: Any) -> Any:
    """Return the outward axis; at a tie x goes before y and y before z (erratum E8).

    A cube's normal in object space: sign and axis of the coordinate of greatest magnitude.
    """
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_x = (x >= y) & (x >= z)
    along_y = ~along_x & (y >= z)
    along_z = ~along_x & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )


def entering_slab(ray: Ray, distance: Any) -> Any:
    """Return the outward axis of the plane that is met nearest to `distance`; at a tie x before y before z.

    A cube's normal by the slab whose plane the ray met at its t, remembered instead of read off the hit point.
    The hit point is off by roundings of the way it went, the slabs' t compare within roundings of each other.
    """
    nearest, axis, sign = None, None, None
    for index, (origin, direction) in enumerate(zip(ray.origin, ray.direction, strict=True)):
        parallel = direction == 0
        for face in (-HALF, HALF):
            t = (face - origin) / dr.select(parallel, 1, direction)
            off = dr.select(parallel, dr.inf, abs(t - distance))
            if nearest is None:
                nearest, axis, sign = off, dr.zeros(dr.uint32_array_t(type(off))), type(off)(face * 2)
                continue
            closer = off < nearest
            nearest = dr.select(closer, off, nearest)
            axis = dr.select(closer, index, axis)
            sign = dr.select(closer, face * 2, sign)
    return type(ray.direction)(*(dr.select(axis == index, sign, 0) for index in range(3)))


def inverse_transpose(normal: Any, transform: Transform) -> Any:
    """Return the renormalised world normal.

    A normal to world space by the inverse transpose of the model matrix's 3x3 part.
    """
    return dr.normalize(transform.normal_to_world(normal))


def whole_matrix(normal: Any, transform: Transform) -> Any:
    """Return xyz of the 4x4 inverse transpose times (n, 0), normalised as a 3-vector.

    Control for erratum E13: the 4x4 matrix, translation included, inverted and transposed.
    """
    rows = np.linalg.inv(np.asarray(transform.to_world)).T
    return dr.normalize(
        type(normal)(*(sum(float(c) * n for c, n in zip(row, normal, strict=False)) for row in rows[:3]))
    )


def with_w(normal: Any, transform: Transform) -> Any:
    """Return xyz of the normalised 4-vector, which is too short wherever the matrix translates.

    Control for erratum E13: the fault that a translation makes when w enters the normalisation.
    """
    rows = np.linalg.inv(np.asarray(transform.to_world)).T
    x, y, z, w = (sum(float(c) * n for c, n in zip(row, normal, strict=False)) for row in rows)
    return dr.normalize(quad(x, y, z, w)).xyz


def model_matrix(normal: Any, transform: Transform) -> Any:
    """Return the 3x3 part times the normal, renormalised.

    A normal to world space by the model matrix itself, as if it were a direction: a control.
    """
    return dr.normalize(transform.vector_to_world(normal))


def viewer(normal: Any, direction: Any) -> Any:
    """Return the normal turned against `direction`.

    The shading normal of a two-sided surface.
    """
    return dr.select(dr.dot(normal, direction) > 0, -normal, normal)
