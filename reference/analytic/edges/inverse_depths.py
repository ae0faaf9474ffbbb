"""Inverse depth of surfaces over the image (`Sheet`), what hides them (`Screens`), and Taylor bounds of zeros [px]."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.reference.analytic.camera import View
from rayproof.reference.analytic.surfaces import Ellipsoid
from rayproof.reference.analytic.vectors import cross, dot, length


def reach(value: np.ndarray, slope: np.ndarray, bend: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return a lower bound [px] of the distance to the nearest zero of a function of the image point.

    `value` and `slope` are the function and the length of its gradient here; `bend` bounds its second derivative within
    `radius` [px], beyond which nothing is claimed. The zero is no nearer than the smallest d with
    slope d + bend d^2 / 2 >= |value|.
    """
    size = np.abs(value)
    with np.errstate(all="ignore"):
        # What is linear takes a root for each slope, of which the eye has one for all its rays.
        curved = bend.any() or not np.isfinite(size).all()
        distance = 2 * size / (slope + np.sqrt(slope**2 + 2 * bend * size if curved else slope**2))
    # 0/0 is a function that vanishes here; other NaN are overflows, where nothing can be claimed.
    distance = np.where((size == 0) | np.isnan(distance), 0.0, distance)
    return np.minimum(distance, radius)


# The inverse depth w of a surface as a function of the image point, with its derivatives.
#
# A point seen at p is eye + D(p) / w(p). For a flat surface w is linear in p: w = n.D / n.(point - eye). For an
# ellipsoid it is a root of |start w + d(p)|^2 = w^2 in unit-sphere space, where d is linear in p: with b = start.d and
# c = |start|^2 - 1, w = (-b +- sqrt(Q)) / c = |d|^2 / (-b -+ sqrt(Q)); Q, a quadratic in p, is the outline's equation.


FARTHEST = 8.0  # px: no curved surface is followed farther than this,
NARROW = 1e-2  # rad: or than this, where pixels are so small that rounding moves edges by many of them


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """Inverse depth [1/m] per ray: value (N,), gradient (N, 2) [1/px], bound of the second derivative within radius."""

    value: np.ndarray
    gradient: np.ndarray
    bend: np.ndarray
    radius: np.ndarray  # px

    def __getitem__(self, rays: np.ndarray) -> "Sheet":
        """Return the sheet of some of the rays."""
        return Sheet(
            value=self.value[rays], gradient=self.gradient[rays], bend=self.bend[rays], radius=self.radius[rays]
        )

    def __setitem__(self, rays: np.ndarray, other: "Sheet") -> None:
        """Write the sheet of some of the rays."""
        self.value[rays], self.gradient[rays] = other.value, other.gradient
        self.bend[rays], self.radius[rays] = other.bend, other.radius

    def meets(self, other: "Sheet") -> np.ndarray:
        """Return a lower bound [px] of the distance to where both sheets have the same depth, shape (N,)."""
        slope = length(self.gradient - other.gradient)
        return reach(self.value - other.value, slope, self.bend + other.bend, np.minimum(self.radius, other.radius))


def farthest(steps: np.ndarray) -> float:
    """Return how far [px] curved surfaces are followed where the direction changes by `steps` (2, 3) a pixel.

    Bounds hold whatever it is; the farther, the larger the second derivatives that they allow for.
    """
    return max(FARTHEST, NARROW / float(np.linalg.norm(steps)))


def no_sheet(count: int) -> Sheet:
    """Return the sheet of rays that meet nothing: w = 0, at infinity."""
    return constant_sheet(count, 0.0)


def constant_sheet(count: int, value: float) -> Sheet:
    """Return a plane across the view, of inverse depth `value` [1/m]."""
    return Sheet(
        value=np.full(count, value),
        gradient=np.zeros((count, 2)),
        bend=np.zeros(count),
        radius=np.full(count, np.inf),
    )


def shell_sheet(view: View, directions: np.ndarray, radius: float) -> Sheet:
    """Return a sphere of `radius` [m] around the eye: w = |D| / radius, convex in the image."""
    lengths = length(directions)
    steps = np.stack([view.across, view.down], axis=1)
    # |D| >= 1 everywhere, so its second derivative is at most that of D, squared.
    bend = np.linalg.norm(steps) ** 2 / radius
    return Sheet(
        value=lengths / radius,
        gradient=directions @ steps / lengths[:, np.newaxis] / radius,
        bend=np.full(len(directions), bend),
        radius=np.full(len(directions), np.inf),
    )


def flat_sheet(view: View, directions: np.ndarray, points: np.ndarray, normals: np.ndarray) -> Sheet:
    """Return the sheet of the planes through `points` (N, 3) with `normals` (N, 3); linear in the image."""
    with np.errstate(all="ignore"):
        # Infinite where the eye lies in the plane itself, which then shows as a line and hides nothing.
        scaled = normals / dot(points - view.eye, normals)[:, np.newaxis]
        return Sheet(
            value=dot(directions, scaled),
            gradient=scaled @ np.stack([view.across, view.down], axis=1),
            bend=np.zeros(len(directions)),
            radius=np.full(len(directions), np.inf),
        )


def ellipsoid_sheet(view: View, directions: np.ndarray, surface: Ellipsoid, inverse_depths: np.ndarray) -> Sheet:
    """Return the sheet of an ellipsoid near the given roots w (N,), up to half-way to where the two roots meet."""
    start = surface.to_unit @ (view.eye - surface.center)
    power = (np.linalg.norm(start) - 1) * (np.linalg.norm(start) + 1)
    along = directions @ surface.to_unit.T
    steps = np.stack([view.across, view.down]) @ surface.to_unit.T
    chord, chord_gradient, chord_bend = outline(start, along, steps)
    slope = length(chord_gradient)
    # Where Q has fallen by no more than half, its square root is smooth, with these derivatives.
    radius = reach(chord / 2, slope, chord_bend, np.full(len(chord), farthest(np.stack([view.across, view.down]))))
    with np.errstate(all="ignore"):
        least = np.sqrt(chord / 2)
        root_bend = chord_bend / (2 * least) + (slope + chord_bend * radius) ** 2 / (4 * least**3)
        sign = np.sign(power * inverse_depths + along @ start)
        root_gradient = chord_gradient / (2 * np.sqrt(chord)[:, np.newaxis])
        gradient = (sign[:, np.newaxis] * root_gradient - steps @ start) / power
        bend = root_bend / np.abs(power)
        # The root farther from the line's start, as |d|^2 / (|b| + sqrt(Q)): where the eye is on the ellipsoid, c is 0.
        far = sign * (along @ start) > 0
        below = np.abs(along @ start) + np.sqrt(chord)
        below_gradient = sign[:, np.newaxis] * (steps @ start) + root_gradient
        steepest = np.linalg.norm(steps @ start) + (slope + chord_bend * radius) / (2 * least)
        shorter = np.minimum(radius, below / (2 * steepest))
        above, step = dot(along, along), np.linalg.norm(steps)
        reaching = length(along) + step * shorter
        lowest = below - steepest * shorter
        far_gradient = 2 * along @ steps.T / below[:, np.newaxis]
        far_gradient = -sign[:, np.newaxis] * (far_gradient - (above / below**2)[:, np.newaxis] * below_gradient)
        far_bend = 2 * step**2 / lowest + 4 * reaching * step * steepest / lowest**2
        far_bend += reaching**2 * (root_bend / lowest**2 + 2 * steepest**2 / lowest**3)
        far &= ~(bend <= far_bend)
    return Sheet(
        value=inverse_depths,
        gradient=np.where(far[:, np.newaxis], far_gradient, gradient),
        bend=np.where(far, far_bend, bend),
        radius=np.where(far, shorter, radius),
    )


def outline(start: np.ndarray, along: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Q (N,), its gradient (N, 2) and the size of its second derivative (N,) for lines start + t along.

    In unit-sphere space, where `along` changes by `steps` (2, 3) per pixel: Q = |along|^2 - |start x along|^2 is
    positive where the line meets the sphere.
    """
    crossed = cross(start, along)
    value = dot(along, along) - dot(crossed, crossed)
    gradient = 2 * metric(start, along) @ steps.T
    bend = 2 * np.linalg.norm(metric(start, steps) @ steps.T)
    return value, gradient, np.full(len(along), bend)


def metric(start: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return C v for vectors (..., 3), where v.C v = |v|^2 - |start x v|^2."""
    return vectors + cross(start, cross(start, vectors))


# What cannot matter: everything behind a surface that keeps standing in front of it.
#
# Behind a flat face is the far side of its plane. Behind an ellipsoid, within its outline, is the far side of the polar
# plane of the apex, which holds the outline itself. The same planes bound what can stand between a light and a point.


# Float64 roundings of a plane's height, relative to the coordinates that enter it, with room to spare.
ROUNDING = 1e-12
# The same of two surfaces in float32, each by the sixteen roundings that limits of distances count.
COARSE = 2 * gamma(16, precision="float32")


@dataclass(frozen=True, kw_only=True)
class Screens:
    """A half-space per ray: points with normal . y + offset > 0 are in front; an infinite offset hides nothing.

    What touches the plane counts as hidden or not by `hides_touching`.
    """

    normals: np.ndarray  # (N, 3) unit
    offsets: np.ndarray  # (N,) m
    hides_touching: bool

    def hides_hulls(self, rays: np.ndarray, hulls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return whether the convex hulls of points (K, corners, 3) lie behind, for each of the rays, shape (n, K).

        Then whether they do so in float32, too, whatever rounding does.
        """
        normals = self.normals[rays]
        heights = normals @ hulls[:, 0].T
        for corner in range(1, hulls.shape[1]):
            np.maximum(heights, normals @ hulls[:, corner].T, out=heights)
        size = float(np.abs(hulls).max(initial=0))
        return self._behind(rays, heights, size), self._behind(rays, heights, size, COARSE)

    def hides_own_hulls(self, rays: np.ndarray, hulls: np.ndarray) -> np.ndarray:
        """Return whether each ray's own hull of points (n, corners, 3) lies behind, shape (n,)."""
        heights = np.einsum("nca,na->nc", hulls, self.normals[rays]).max(axis=1, initial=-np.inf)
        return self._behind(rays, heights[:, np.newaxis], float(np.abs(hulls).max(initial=0)))[:, 0]

    def hides_ellipsoid(self, surface: Ellipsoid) -> np.ndarray:
        """Return whether an ellipsoid lies behind, for every ray, shape (N,)."""
        heights = self.normals @ surface.center + length(self.normals @ surface.axes)
        size = np.abs(surface.center).max() + np.abs(surface.axes).max()
        return self._behind(np.arange(len(heights)), heights[:, np.newaxis], float(size))[:, 0]

    def _behind(self, rays: np.ndarray, heights: np.ndarray, size: float, rounding: float = ROUNDING) -> np.ndarray:
        offsets = self.offsets[rays, np.newaxis]
        slack = rounding * (size + np.where(np.isfinite(offsets), np.abs(offsets), 0))
        return heights + offsets <= (slack if self.hides_touching else -slack)


def no_screens(count: int, *, hides_touching: bool) -> Screens:
    """Return screens that hide nothing, to be written into."""
    return Screens(normals=np.zeros((count, 3)), offsets=np.full(count, np.inf), hides_touching=hides_touching)


def flat_screen(apex: np.ndarray, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and offsets of the planes through `points` (N, 3), with the apex in front."""
    with np.errstate(all="ignore"):
        units = normals / length(normals)[:, np.newaxis]
    units = units * np.where(dot(apex - points, units)[:, np.newaxis] < 0, -1.0, 1.0)
    return units, -dot(points, units)


def polar_screen(apex: np.ndarray, surface: Ellipsoid) -> tuple[np.ndarray, float]:
    """Return normal and offset of the polar plane of an apex outside the ellipsoid, with the apex in front."""
    normal = surface.to_unit.T @ (surface.to_unit @ (apex - surface.center))
    size = np.linalg.norm(normal)
    return normal / size, float(-(normal @ surface.center + 1) / size)
