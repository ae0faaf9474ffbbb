"""A scene's surfaces and camera in pairs, and a ball around each bounded shape to skip it."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.reference.double_double.arithmetic import (
    PI,
    Bool,
    Float,
    Pair,
    Questions,
    Rational,
    cross,
    fractions,
    minus,
    pair,
    tangent,
    unit,
)
from rayproof.reference.double_double.shapes import PairCrossing, PairCube, PairSpan, PairSphere, Seen, SeenTriangles
from rayproof.reference.double_double.vectors import (
    ConstantMatrix,
    Vector,
    constant,
    pair_dot,
    placement_of,
    plus,
    scaled,
    terms,
)

# Of the sum of all lengths involved: two dozen roundings of 2^-53 are less than a hundredth of it, and what is ruled
# out is so far off that, were it asked in pairs, what rules it out would have a margin far above 2^-80.
ROOM = 2.0**-40
TINY = 1e-280  # squares below it lose digits


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball as seen from an apex, with room."""

    to_center: tuple[Float, Float, Float]  # [m]
    radius_square: Float  # [m^2]

    def may_be_met(self, ray: Vector, span: PairSpan) -> Bool:
        """Return where a ray comes near, ahead of the apex and before the end of a shadow ray; where unsure, true."""
        x, y, z = (part.high for part in ray)
        a, b, c = self.to_center
        square = x * x + y * y + z * z
        nearest = (x * a + y * b + z * c) * (1 / square)
        nearest = dr.select(nearest < 0, 0, nearest)
        if span.is_shadow_ray:
            nearest = dr.select(nearest > 1, 1, nearest)
        p, q, r = a - nearest * x, b - nearest * y, c - nearest * z
        # Not "is nearer", so that NaN rules out nothing.
        return ~(p * p + q * q + r * r > self.radius_square) | (square < TINY)


def ball_of(shape: Shape, apex: Rational, types: Any) -> Ball | None:
    """Return the ball around a shape, None around a plane."""
    if isinstance(shape, Plane):
        return None
    center, radius, sizes = _around(shape)
    eye = np.array([float(value) for value in apex])
    reach = radius + ROOM * (sizes + float(np.linalg.norm(eye)))
    x, y, z = (dr.opaque(types.Float64, value) for value in (center - eye).tolist())
    return Ball(to_center=(x, y, z), radius_square=dr.opaque(types.Float64, reach * reach))


@lru_cache(maxsize=256)
def _around(shape: Shape) -> tuple[np.ndarray, float, float]:
    """Return centre and radius, and the sum of the lengths that they were computed from [m]."""
    place = np.array(shape.to_world, dtype=np.float64)
    matrix, offset = place[:3, :3], place[:3, 3]
    stretch = float(np.linalg.norm(matrix, ord=2))
    if isinstance(shape, Sphere):
        center, radius = matrix @ np.array(shape.center) + offset, shape.radius * stretch
        return center, radius, stretch * float(np.linalg.norm(shape.center)) + float(np.linalg.norm(offset)) + radius
    if isinstance(shape, Cube | Square):
        height = 0.5 if isinstance(shape, Cube) else 0.0
        corners = np.stack(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-height, height]), axis=-1).reshape(-1, 3)
        points = corners @ matrix.T + offset
    else:
        points = np.asarray(world_triangles(shape), dtype=np.float64).reshape(-1, 3)
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - center, axis=1).max())
    return center, radius, float(np.linalg.norm(offset)) + float(np.linalg.norm(center)) + radius


# A scene's constants as pairs: the camera's frame, the shapes as seen from the eye and from each light.


EYE = -1  # apexes: the eye, or the number of a light


class PairPlane:
    """The plane z = 0 of object space, or its square."""

    is_convex = True

    def __init__(self, shape: Plane | Square, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        start = place.local(apex)
        self.to_local = ConstantMatrix(place.inverse, types.Float64)
        self.start = constant(start, types.Float64)
        self.upward = constant(unit(place.inverse[2]), types.Float64)
        self.bounded = isinstance(shape, Square)
        self.half = pair(Fraction(1, 2), types.Float64)

    def crossing(
        self, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> PairCrossing:
        """Return the crossing if it counts."""
        del without, only
        along = self.to_local(ray)
        ask.note(along[2], terms(self.upward, ray), asked)
        t = -self.start[2] / along[2]
        hit = ~along[2].is_zero() & asked
        hit &= span.holds(t, t.size(), hit, ask)
        for axis in (0, 1) if self.bounded else ():
            step = t * along[axis]
            coordinate = self.start[axis] + step
            scale = self.start[axis].size() + step.size() + 0.5
            hit &= ask.is_less(coordinate.absolute(), self.half, hit, scale)
        return PairCrossing(t, hit, self.types.Int32(0))

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return false: there is no second root."""
        del segment, ask, where
        return self.types.Bool(False)

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the third row of the inverse."""
        del segment, face, ask, where
        return self.upward


class PairWorld:
    """The parts of a scene that the stages need; `types` is the module of Dr.Jit's arrays."""

    def __init__(self, scene: Scene, types: Any) -> None:
        self.scene, self.types = scene, types
        camera = scene.camera
        self.apexes: dict[int, Rational] = {EYE: fractions(camera.eye)}
        self.apexes |= {number: fractions(light.position) for number, light in enumerate(scene.lights)}
        self.points = {number: constant(point, types.Float64) for number, point in self.apexes.items()}
        self._seen: dict[tuple[int, int], tuple[Seen, Ball | None]] = {}

    def pair(self, value: float | Fraction) -> Pair:
        """Return an exact constant."""
        return pair(Fraction(value), self.types.Float64)

    @cached_property
    def frame(self) -> "CameraFrame":
        """Return the camera's frame."""
        return CameraFrame(self.scene.camera, self.types)

    def seen(self, shape: int, apex: int) -> tuple[Seen, Ball | None]:
        """Return a shape as seen from an apex, and the ball around it if it is bounded."""
        key = (shape, apex)
        if key not in self._seen:
            told = self.scene.shapes[shape], self.apexes[apex], self.types
            self._seen[key] = _see(*told), ball_of(*told)
        return self._seen[key]

    def clip(self, ray: Vector) -> PairSpan:
        """Return where crossings of a camera ray count (HIT-2)."""
        camera, clip = self.scene.camera, self.scene.clip
        if clip == "none":
            return PairSpan(low=None, high=None, speed=None)
        depth = None
        if clip == "depth":
            depth = pair_dot(self.frame.forward, ray)
        return PairSpan(low=self.pair(camera.near), high=self.pair(camera.far), speed=depth)

    @cached_property
    def strengths(self) -> list[list[Pair | None]]:
        """Return per light and channel flux / (4 pi), or the flux where shading is simplified; None for none."""
        scale = Fraction(1) if self.scene.shading == "simplified" else 1 / (4 * PI)
        return [
            [self.pair(Fraction(flux) * scale) if flux else None for flux in light.flux] for light in self.scene.lights
        ]

    @cached_property
    def albedos(self) -> list[Any]:
        """Return per channel each shape's albedo, which is a float64, and 0 for no shape."""
        albedos = [*(shape.albedo for shape in self.scene.shapes), (0.0, 0.0, 0.0)]
        return [self.types.Float64(list(channel)) for channel in zip(*albedos, strict=True)]

    @cached_property
    def inverse_pi(self) -> Pair:
        """Return 1 / pi."""
        return self.pair(1 / PI)


class CameraFrame:
    """Unit axes, and the half extents of the image at depth 1 along them (CAM-1 to CAM-4)."""

    def __init__(self, camera: Camera, types: Any) -> None:
        forward = minus(fractions(camera.target), fractions(camera.eye))
        right = cross(forward, fractions(camera.up))
        F, R = unit(forward), unit(right)
        half_height = tangent(Fraction(camera.fovy) / 2)
        half_width = half_height * camera.width / camera.height
        self.forward = constant(F, types.Float64)
        across = [part * half_width for part in R]
        up = [part * half_height for part in cross(R, F)]
        self.corner = constant([f - x + y for f, x, y in zip(F, across, up, strict=True)], types.Float64)
        self.column = constant([2 * part / camera.width for part in across], types.Float64)
        self.row = constant([-2 * part / camera.height for part in up], types.Float64)
        self.types = types

    def direction(self, px: Float, py: Float) -> Vector:
        """Return the direction of depth 1 through image points [px]."""
        zero = self.types.Float64(0)
        return plus(self.corner, plus(scaled(self.column, Pair(px, zero)), scaled(self.row, Pair(py, zero))))


def _see(shape: Any, apex: Rational, types: Any) -> Seen:
    if isinstance(shape, Sphere):
        return PairSphere(shape, apex, types)
    if isinstance(shape, Cube):
        return PairCube(shape, apex, types)
    if isinstance(shape, Plane | Square):
        return PairPlane(shape, apex, types)
    if isinstance(shape, Triangle | Mesh):
        return SeenTriangles(shape, apex, types)
    raise TypeError(f"double_double knows no shape {type(shape).__name__}")
