"""What an apex (the eye, or a light) sees of a pixel's point, as a function of the image point.

Up to a positive factor the direction from the apex to the point eye + D(p) / w(p) is q(p) = w(p) (eye - apex) + D(p):
linear in p where the point lies on a flat surface, and always where the apex is the eye.
"""

from dataclasses import dataclass

import numpy as np

from reference.analytic.edges.bounds import reach
from reference.analytic.edges.sheets import Sheet, no_sheet
from reference.analytic.views import View


@dataclass(frozen=True, kw_only=True)
class Sight:
    """The directions q (N, 3) from an apex, and how they change with the image point."""

    apex: np.ndarray  # (3,) m
    offset: np.ndarray  # (3,) m, eye - apex
    steps: np.ndarray  # (2, 3) change of D per pixel
    directions: np.ndarray  # (N, 3)
    sheet: Sheet

    def jacobian(self) -> np.ndarray:
        """Return the change of q per pixel, shape (N, 2, 3)."""
        return self.sheet.gradient[:, :, np.newaxis] * self.offset + self.steps

    def linear(self, rays: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q.v and a lower bound [px] of the distance to its zero, for rays x vectors (K, 3): shapes (n, K)."""
        value = self.directions[rays] @ vectors.T
        lever = vectors @ self.offset
        across, down = (
            self.sheet.gradient[rays, axis, np.newaxis] * lever + vectors @ self.steps[axis] for axis in range(2)
        )
        bend = self.sheet.bend[rays, np.newaxis] * np.abs(lever)
        return value, reach(value, np.hypot(across, down), bend, self.sheet.radius[rays, np.newaxis])

    def caps(self, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return distances [px] up to `farthest` in which q changes moderately, and by how much there, both (N,)."""
        speed = np.linalg.norm(self.jacobian(), axis=(1, 2))
        lengths = np.linalg.norm(self.directions, axis=1)
        with np.errstate(all="ignore"):
            caps = np.minimum(farthest, np.minimum(self.sheet.radius, 0.25 * lengths / speed))
        swing = np.linalg.norm(self.offset) * self.sheet.bend * caps
        return caps, (speed + np.nan_to_num(swing)) * caps


def sight_from_eye(view: View, directions: np.ndarray) -> Sight:
    """Return how the eye sees the image points: q = D, whatever the surface."""
    return _sight(view.eye, view, directions, no_sheet(len(directions)))


def sight_from_light(source: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    """Return how a light at `source` [m] sees the points of a sheet."""
    seen = directions + sheet.value[:, np.newaxis] * (view.eye - source)
    return _sight(source, view, seen, sheet)


def _sight(apex: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    steps = np.stack([view.across, view.down])
    return Sight(apex=apex, offset=view.eye - apex, steps=steps, directions=directions, sheet=sheet)
