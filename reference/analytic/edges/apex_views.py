"""What an apex (the eye, or a light) sees of a pixel's point, as a function of the image point.

Up to a positive factor the direction from the apex to the point eye + D(p) / w(p) is q(p) = w(p) (eye - apex) + D(p):
linear in p where the point lies on a flat surface, and always where the apex is the eye.
"""

from dataclasses import dataclass, replace

import numpy as np

from rayproof.reference.analytic.camera_frame import View
from rayproof.reference.analytic.edges.bounds import reach
from rayproof.reference.analytic.edges.inverse_depths import Sheet, no_sheet
from rayproof.reference.analytic.vectors import length


@dataclass(frozen=True, kw_only=True)
class Sight:
    """The directions q (N, 3) from an apex, and how they change with the image point."""

    apex: np.ndarray  # (3,) m
    offset: np.ndarray  # (3,) m, eye - apex
    steps: np.ndarray  # (2, 3) change of D per pixel
    directions: np.ndarray  # (N, 3)
    sheet: Sheet  # of each ray, or one for all

    def jacobian(self) -> np.ndarray:
        """Return the change of q per pixel, shape (N, 2, 3), or (1, 2, 3) where it is the same for all."""
        return self.sheet.gradient[:, :, np.newaxis] * self.offset + self.steps

    def __getitem__(self, rays: np.ndarray) -> "Sight":
        """Return the sight of some of the rays."""
        sheet = self.sheet if len(self.sheet.value) == 1 else self.sheet[rays]
        return replace(self, directions=self.directions[rays], sheet=sheet)

    def linear(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q.v and a lower bound [px] of the distance to its zero, for rays x vectors (K, 3): shapes (N, K)."""
        value = self.directions @ vectors.T
        lever, sheet = vectors @ self.offset, self.sheet
        across, down = (sheet.gradient[:, axis, np.newaxis] * lever + vectors @ self.steps[axis] for axis in range(2))
        bend = sheet.bend[:, np.newaxis] * np.abs(lever)
        return value, reach(value, np.hypot(across, down), bend, sheet.radius[:, np.newaxis])

    def caps(self, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return distances [px] up to `farthest` in which q changes moderately, and by how much there, both (N,)."""
        speed = np.linalg.norm(self.jacobian(), axis=(1, 2))
        lengths = length(self.directions)
        with np.errstate(all="ignore"):
            caps = np.minimum(farthest, np.minimum(self.sheet.radius, 0.25 * lengths / speed))
        swing = np.linalg.norm(self.offset) * self.sheet.bend * caps
        return caps, (speed + np.nan_to_num(swing)) * caps


def sight_from_eye(view: View, directions: np.ndarray) -> Sight:
    """Return how the eye sees the image points: q = D, whatever the surface."""
    return _sight(view.eye, view, directions, no_sheet(1))


def sight_from_light(source: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    """Return how a light at `source` [m] sees the points of a sheet."""
    seen = directions + sheet.value[:, np.newaxis] * (view.eye - source)
    return _sight(source, view, seen, sheet)


def _sight(apex: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    steps = np.stack([view.across, view.down])
    return Sight(apex=apex, offset=view.eye - apex, steps=steps, directions=directions, sheet=sheet)
