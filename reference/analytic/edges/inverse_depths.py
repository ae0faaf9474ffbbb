"""The inverse depth w of a surface as a function of the image point, with its derivatives.

A point seen at p is eye + D(p) / w(p). For a flat surface w is linear in p: w = n.D / n.(point - eye). For an ellipsoid
it is a root of |start w + d(p)|^2 = w^2 in unit-sphere space, where d is linear in p: with c = |start|^2 - 1 and
b = start.d, w = (-b +- sqrt(Q)) / c = |d|^2 / (-b -+ sqrt(Q)), and Q, a quadratic in p, is the outline's own equation.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.reference.analytic.camera_frame import View
from rayproof.reference.analytic.edges.bounds import reach
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.vectors import cross, dot, length

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
