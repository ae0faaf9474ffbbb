"""The camera stage: matrices, inverses and frustum corners from certified balls, rounded once (CAM-1 to CAM-3)."""

from typing import Any

import numpy as np
from flint import fmpq

from rayproof.cases.scene import Camera
from rayproof.reference.certified.camera_frame import View, view_of
from rayproof.reference.certified.fields import Balls, exact, precision
from rayproof.reference.certified.vectors import dot

BITS = 512


def camera_answer(camera: Camera) -> dict[str, np.ndarray]:
    """Return the dictionary of `cases.stages` for `Stage.CAMERA`."""
    with precision(BITS) as field:
        return _matrices(view_of(camera, field), field) | _pixels(camera)


def _matrices(view: View, field: Balls) -> dict[str, np.ndarray]:
    camera = view.camera
    near, far = field.number(exact(camera.near)), field.number(exact(camera.far))
    axes = (view.right, view.up, view.forward)
    slope = far / (far - near)
    corners = [
        [
            view.eye[axis]
            + depth
            * (view.forward[axis] + sx * view.half_width * view.right[axis] + sy * view.half_height * view.up[axis])
            for axis in range(3)
        ]
        for depth in (near, far)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return {
        "view": _floats([*([*row, -dot(row, view.eye)] for row in axes), [0, 0, 0, 1]]),
        "view_inverse": _floats([*([row[axis] for row in axes] + [view.eye[axis]] for axis in range(3)), [0, 0, 0, 1]]),
        "projection": _floats(
            [
                [1 / view.half_width, 0, 0, 0],
                [0, 1 / view.half_height, 0, 0],
                [0, 0, slope, -near * slope],
                [0, 0, 1, 0],
            ]
        ),
        # Solved from the rows above: z = w', 1 = (w' - z' / slope) / near.
        "projection_inverse": _floats(
            [
                [view.half_width, 0, 0, 0],
                [0, view.half_height, 0, 0],
                [0, 0, 0, 1],
                [0, 0, -1 / (near * slope), 1 / near],
            ]
        ),
        "frustum_corners": _floats(corners),
    }


def _pixels(camera: Camera) -> dict[str, np.ndarray]:
    """Return (sx, sy) of every pixel centre, and the centres, exact rationals rounded once."""
    horizontal = [_nearest(2 * fmpq(2 * column + 1, 2) / camera.width - 1) for column in range(camera.width)]
    vertical = [_nearest(1 - 2 * fmpq(2 * row + 1, 2) / camera.height) for row in range(camera.height)]
    rows, columns = np.mgrid[: camera.height, : camera.width]
    return {
        "ndc": np.stack(np.meshgrid(horizontal, vertical), axis=-1),
        "pixel": np.stack([columns + 0.5, rows + 0.5], axis=-1),
    }


def _nearest(value: fmpq) -> float:
    return int(value.p) / int(value.q)


def _floats(values: list[list[Any]]) -> np.ndarray:
    return np.array([[float(value) for value in row] for row in values])
