"""Distance in the image to the outline of a surface as an apex sees it: silhouettes from the eye, shadows from a light.

An outline is a condition on the direction q from the apex alone. An edge is met where q lies in the fan that it spans
with the apex: on one plane, and between two others. An ellipsoid's outline is a quadratic cone, of which one half
counts.
"""

import numpy as np

from rayproof.reference.analytic.edges.apex_views import Sight
from rayproof.reference.analytic.edges.borders import Borders
from rayproof.reference.analytic.edges.bounds import reach
from rayproof.reference.analytic.edges.inverse_depths import farthest, metric
from rayproof.reference.analytic.edges.occlusion import Screens
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.pencils import FEW, bundles
from rayproof.reference.analytic.polygons import blocks
from rayproof.reference.analytic.vectors import cross, dot, length

# With this many edges hardly a pixel of theirs is farther than that from the nearest, and looking farther is slow.
MANY = 2000
FARTHEST_OF_MANY = 1.0  # px


def edge_distances(sight: Sight, borders: Borders, counted: np.ndarray, screens: Screens) -> np.ndarray:
    """Return a lower bound [px] of the distance to the nearest counted (E,) edge that is not hidden, shape (N,).

    With many edges, those farther than a few pixels are not looked at, and that distance is returned instead.
    """
    distances, margins = np.full(len(sight.directions), np.inf), np.zeros(len(sight.directions))
    many = int(np.count_nonzero(counted))
    if many > FEW:
        distances, margins = sight.caps(farthest(sight.steps) if many < MANY else FARTHEST_OF_MANY)
    for some in blocks(len(counted)):
        _near_edges(sight, borders, some.start + np.flatnonzero(counted[some]), screens, distances, margins)
    return distances


def _near_edges(
    sight: Sight, borders: Borders, counted: np.ndarray, screens: Screens, distances: np.ndarray, margins: np.ndarray
) -> None:
    """Lower `distances` (N,) to those of some edges, by their numbers; `margins` (N,) say how far is looked."""
    starts, ends = borders.starts[counted] - sight.apex, borders.ends[counted] - sight.apex
    hulls = borders.hulls[counted]
    planes = cross(starts, ends - starts)
    # An edge on a line through the apex is seen as a point, which its neighbours end in.
    spread = planes.any(axis=1)
    starts, ends, hulls, planes = starts[spread], ends[spread], hulls[spread], planes[spread]
    from_start, from_end = cross(planes, starts), cross(ends, planes)
    for rays, edges in bundles(sight.directions, np.stack([starts, ends], axis=1), margins):
        part = sight[rays]
        _, near = part.linear(planes[edges])
        for side in (from_start, from_end):
            # Most edges of a mesh are too far already.
            left = np.flatnonzero((near < distances[rays, np.newaxis]).any(axis=0))
            edges, near = edges[left], near[:, left]
            value, distance = part.linear(side[edges])
            near = np.maximum(near, np.where(value < 0, distance, 0))
        left = np.flatnonzero((near < distances[rays, np.newaxis]).any(axis=0))
        near = np.where(screens.hides_hulls(rays, hulls[edges[left]]), np.inf, near[:, left])
        distances[rays] = np.minimum(distances[rays], near.min(axis=1, initial=np.inf))


def ellipsoid_distances(sight: Sight, surface: Ellipsoid, screens: Screens) -> np.ndarray:
    """Return a lower bound [px] of the distance to an ellipsoid's outline, inf where it is hidden, shape (N,)."""
    start = surface.to_unit @ (sight.apex - surface.center)
    if np.linalg.norm(start) <= 1:
        return np.full(len(sight.directions), np.inf)
    along = sight.directions @ surface.to_unit.T
    offset = surface.to_unit @ sight.offset
    steps = sight.jacobian() @ surface.to_unit.T
    sheet = sight.sheet

    # Q and its derivatives by the chain rule: q changes by `steps`, and they by offset x (second derivative of w).
    crossed = cross(start, along)
    value = dot(along, along) - dot(crossed, crossed)
    gradient = 2 * (steps @ metric(start, along)[:, :, np.newaxis])[:, :, 0]
    bend = 2 * np.linalg.norm(metric(start, steps) @ steps.transpose(0, 2, 1), axis=(1, 2))
    if offset.any() and sheet.bend.any():
        radius = np.minimum(sheet.radius, farthest(sight.steps))
        bent_offset = metric(start, offset)
        with np.errstate(all="ignore"):
            swing = sheet.bend * radius
            drag = length(steps @ bent_offset)
            own = abs(bent_offset @ offset)
            bend = bend + 4 * drag * swing + 2 * own * swing**2
            bend += 2 * sheet.bend * (np.abs(along @ bent_offset) + drag * radius + own * swing * radius / 2)
    cone = reach(value, length(gradient), bend, sheet.radius)

    # Of the double cone only the half towards the ellipsoid counts.
    toward = -surface.to_unit.T @ start
    side, distance = sight.linear(toward[np.newaxis])
    distances = np.maximum(cone, np.where(side < 0, distance, 0)[:, 0])
    return np.where(screens.hides_ellipsoid(surface), np.inf, distances)
