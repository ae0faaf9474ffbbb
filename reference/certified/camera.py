"""The camera in any field: exact frame, matrices and pixels, up to square roots and one tangent (CAM-1 to CAM-4)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq

from rayproof.cases.scene import Camera
from rayproof.reference.certified.fields import Balls, Number, NumberField, Vector, exact, precision
from rayproof.reference.certified.numbers import cross, dot, minus, numbers, scaled
from rayproof.reference.certified.shapes import rational


@dataclass(frozen=True, kw_only=True)
class ExactCamera:
    """Unit axes, and the half extents of the image at depth 1."""

    field: NumberField
    camera: Camera
    eye: Vector  # m
    forward: Vector
    right: Vector
    up: Vector
    half_width: Number
    half_height: Number

    def ndc(self, px: float, py: float) -> tuple[fmpq, fmpq]:
        """Return (sx, sy) of an image point [px], exactly."""
        return 2 * exact(px) / self.camera.width - 1, 1 - 2 * exact(py) / self.camera.height

    def sideways(self, px: float) -> Vector:
        """Return the sideways part of the direction of depth 1 through a column [px]."""
        return scaled(self.right, self.half_width * self.field.number(self.ndc(px, 0)[0]))

    def upwards(self, py: float) -> Vector:
        """Return the direction of depth 1 through a row [px] in the middle of the image."""
        step = scaled(self.up, self.half_height * self.field.number(self.ndc(0, py)[1]))
        return (self.forward[0] + step[0], self.forward[1] + step[1], self.forward[2] + step[2])


def view_of(camera: Camera, field: NumberField) -> ExactCamera:
    """Return a camera's frame: F towards the target, R = F x up, U = R x F."""
    eye = rational(camera.eye)
    forward = minus(rational(camera.target), eye)
    right = cross(forward, rational(camera.up))
    F = _unit(field, numbers(field, forward))
    R = _unit(field, numbers(field, right))
    half_height = field.tan_degrees(exact(camera.fovy) / 2)
    return ExactCamera(
        field=field,
        camera=camera,
        eye=numbers(field, eye),
        forward=F,
        right=R,
        up=cross(R, F),
        half_width=half_height * field.number(fmpq(camera.width, camera.height)),
        half_height=half_height,
    )


def _unit(field: NumberField, vector: Vector) -> Vector:
    length = field.sqrt(dot(vector, vector))
    return (vector[0] / length, vector[1] / length, vector[2] / length)


# The camera stage: matrices, inverses and frustum corners from certified balls, rounded once (CAM-1 to CAM-3).


BITS = 512


def camera_answer(camera: Camera) -> dict[str, np.ndarray]:
    """Return the dictionary of `cases.stages` for `Stage.CAMERA`."""
    with precision(BITS) as field:
        return _matrices(view_of(camera, field), field) | _pixels(camera)


def _matrices(view: ExactCamera, field: Balls) -> dict[str, np.ndarray]:
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
    """Return (sx, sy) of every pixel centre, and the centres [px]: exact rationals that are rounded once."""
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
