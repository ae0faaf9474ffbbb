"""The camera: an exact frame up to square roots and one tangent, in any field (CAM-1 to CAM-4)."""

from dataclasses import dataclass

from flint import fmpq

from rayproof.cases.scene import Camera
from rayproof.reference.certified.fields import Field, Number, Vector, exact
from rayproof.reference.certified.placements import rational
from rayproof.reference.certified.vectors import cross, dot, minus, numbers, scaled


@dataclass(frozen=True, kw_only=True)
class View:
    """Unit axes, and the half extents of the image at depth 1."""

    field: Field
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
        """Return what a column [px] adds to the direction of depth 1."""
        return scaled(self.right, self.half_width * self.field.number(self.ndc(px, 0)[0]))

    def upwards(self, py: float) -> Vector:
        """Return the direction of depth 1 through a row [px] in the middle of the image."""
        step = scaled(self.up, self.half_height * self.field.number(self.ndc(0, py)[1]))
        return (self.forward[0] + step[0], self.forward[1] + step[1], self.forward[2] + step[2])


def view_of(camera: Camera, field: Field) -> View:
    """Return a camera's frame: F towards the target, R = F x up, U = R x F."""
    eye = rational(camera.eye)
    forward = minus(rational(camera.target), eye)
    right = cross(forward, rational(camera.up))
    F = _unit(field, numbers(field, forward))
    R = _unit(field, numbers(field, right))
    half_height = field.tan_degrees(exact(camera.fovy) / 2)
    return View(
        field=field,
        camera=camera,
        eye=numbers(field, eye),
        forward=F,
        right=R,
        up=cross(R, F),
        half_width=half_height * field.number(fmpq(camera.width, camera.height)),
        half_height=half_height,
    )


def _unit(field: Field, vector: Vector) -> Vector:
    length = field.sqrt(dot(vector, vector))
    return (vector[0] / length, vector[1] / length, vector[2] / length)
