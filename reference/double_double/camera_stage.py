"""The camera stage from exact fractions, each number rounded once (CAM-1 to CAM-3)."""

from fractions import Fraction
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.reference.double_double.constants import cross, dot, fractions, minus, root, tangent


def camera_answer(camera: Camera) -> dict[str, np.ndarray]:
    """Return the dictionary of `cases.stages` for `Stage.CAMERA`."""
    eye = fractions(camera.eye)
    forward = minus(fractions(camera.target), eye)
    right = cross(forward, fractions(camera.up))
    F = [part / root(dot(forward, forward)) for part in forward]
    R = [part / root(dot(right, right)) for part in right]
    U = list(cross(R, F))
    tall = tangent(Fraction(camera.fovy) / 2)
    wide = tall * camera.width / camera.height
    near, far = Fraction(camera.near), Fraction(camera.far)
    slope = far / (far - near)
    columns = [Fraction(2 * column + 1, camera.width) - 1 for column in range(camera.width)]
    rows = [1 - Fraction(2 * row + 1, camera.height) for row in range(camera.height)]
    down, across = np.mgrid[: camera.height, : camera.width]
    return {
        "view": _floats([*([*axis, -dot(axis, eye)] for axis in (R, U, F)), [0, 0, 0, 1]]),
        "view_inverse": _floats([*([R[k], U[k], F[k], eye[k]] for k in range(3)), [0, 0, 0, 1]]),
        "projection": _floats([[1 / wide, 0, 0, 0], [0, 1 / tall, 0, 0], [0, 0, slope, -near * slope], [0, 0, 1, 0]]),
        "projection_inverse": _floats(
            [[wide, 0, 0, 0], [0, tall, 0, 0], [0, 0, 0, 1], [0, 0, -1 / (near * slope), 1 / near]]
        ),
        "frustum_corners": _floats(
            [
                [eye[k] + depth * (F[k] + sx * wide * R[k] + sy * tall * U[k]) for k in range(3)]
                for depth in (near, far)
                for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        ),
        "ndc": np.stack(np.meshgrid([float(x) for x in columns], [float(y) for y in rows]), axis=-1),
        "pixel": np.stack([across + 0.5, down + 0.5], axis=-1),
    }


def _floats(values: list[Any]) -> np.ndarray:
    return np.array([[float(value) for value in row] for row in values])
