"""Formulas of the camera: basis, view and projection matrices, their inverses, frustum corners, pixel and NDC."""

import math
from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arithmetic import matrix, unit

ORDER = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # (sx, sy) of the frustum's corners


def half_extent(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return (aspect tan(alpha), tan(alpha)) with alpha = fovy / 2; fovy in degrees.

    Half-sizes of the image at depth 1, by the tangent of half the vertical angle.
    """
    alpha = Float(math.radians(fovy) / 2)
    # Not dr.tan, which in float64 is off by alpha^2 / 3 below 1e-4: it returns alpha itself.
    tangent = dr.sin(alpha) / dr.cos(alpha)
    return tangent * aspect, tangent


def basis(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return right F x U, up and forward F, unit and orthogonal.

    The camera's axes.
    """
    forward = unit(target - eye)
    right = unit(dr.cross(forward, unit(up)))
    return right, dr.cross(right, forward), forward


def view(eye: Any, right: Any, up: Any, forward: Any) -> Any:
    """Return world -> camera [m]: the axes as rows, and the eye moved to the origin.

    The view matrix.
    """
    rows = [[*axis, -dr.dot(axis, eye)] for axis in (right, up, forward)]
    return matrix([*rows, [0, 0, 0, 1]], like=right.x)


def projection(horizontal: Any, vertical: Any, near: Any, far: Any) -> Any:
    """Return camera -> clip with w = depth; after the division by w depth near goes to 0 and far to 1.

    The perspective projection matrix.
    """
    stretch = far / (far - near)
    return matrix(
        [
            [1 / horizontal, 0, 0, 0],
            [0, 1 / vertical, 0, 0],
            [0, 0, stretch, -near * stretch],
            [0, 0, 1, 0],
        ],
        like=near,
    )


def inverse(matrix: Any) -> Any:
    """Return the inverse of a 4x4 matrix by cofactors.

    The inverse of a camera matrix: one per camera, never one per pixel.
    """
    return dr.rcp(matrix)


def corners(frame: Any) -> list[Any]:
    """Return the eight corners in world space [m], near plane first, each plane in the order of `ORDER`.

    The corners of the frustum.
    """
    return [
        frame.eye + depth * (frame.forward + sx * frame.horizontal * frame.right + sy * frame.vertical * frame.up)
        for depth in (frame.near, frame.far)
        for sx, sy in ORDER
    ]


def centre(column: Any, row: Any, per_side: int) -> tuple[Any, Any]:
    """Return image coordinates (px, py) of a sample's centre; pixel (0, 0) reaches from 0 to 1.

    Where in the image a pixel is sampled: at its centre, or at the centres of a regular subdivision.
    """
    return (column + 0.5) / per_side, (row + 0.5) / per_side


def corner(column: Any, row: Any, per_side: int) -> tuple[Any, Any]:
    """Return the sample's top-left corner, which shifts every image by half a sample.

    Control for erratum E1: pixel coordinates without saying corner or centre.
    """
    return column / per_side, row / per_side


def ndc(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sx = 2 px / W - 1 to the right and sy = 1 - 2 py / H upwards.

    From pixels to normalised device coordinates.
    """
    return 2 * px / width - 1, 1 - 2 * py / height


def pixel(sx: Any, sy: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return px = (sx + 1) W / 2 and py = (1 - sy) H / 2.

    From normalised device coordinates back to pixels.
    """
    return (sx + 1) * width / 2, (1 - sy) * height / 2
