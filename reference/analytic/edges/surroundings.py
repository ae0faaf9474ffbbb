"""Whether faces of one mesh go on all around an image point, and each face near it.

An edge whose two faces project to its two sides is crossed without leaving the mesh. So a mesh that is seen at a point
is seen as far around it as no other edge of it reaches, whatever inner edges and vertices lie in between; unless
clipping cuts it, or another surface comes before it. Rounding moves edges and ray, but opens nothing: what covers the
whole of a disc still covers its middle after every point has moved by less than the disc's radius.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import View, view_of
from rayproof.reference.analytic.edges.hits import hits_of, meetings_of, next_depths
from rayproof.reference.analytic.edges.inverse_depths import no_screens
from rayproof.reference.analytic.edges.outlines import (
    borders_of,
    edge_distances,
    ellipsoid_distances,
    sight_from_eye,
    sight_from_light,
)
from rayproof.reference.analytic.edges.shadows import shadow_distances
from rayproof.reference.analytic.surfaces import Ellipsoid, Polygons, bundles, surface_of
from rayproof.reference.analytic.vectors import dot, length

# Of near and far: faces nearer to the clip interval's ends may be cut off by rounding, 1e-6 of them in float32.
CLIPPED = 1e-3


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """The surroundings of n image points within a radius of each."""

    enclosed: np.ndarray  # (n,) whether the mesh that is seen goes on over the whole radius
    points: np.ndarray  # (k,) of each face near one of the points: which point
    places: np.ndarray  # (k, 2, 2) px, and two image points on the face, hardly farther away than the radius


def surroundings(scene: Scene, points: np.ndarray, radius: np.ndarray) -> Surroundings:
    """Return what is around image points (n, 2) [px] within a radius (n,) [px] of each."""
    found = [_faces_near(scene, index, points, radius) for index in range(len(scene.shapes))]
    return Surroundings(
        enclosed=_rim_distances(scene, points) > radius,
        points=np.concatenate([np.zeros(0, dtype=int), *(rows for rows, _ in found)]),
        places=np.concatenate([np.zeros((0, 2, 2)), *(places for _, places in found)]),
    )


def _rim_distances(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return a lower bound [px] of the distance to where the mesh that is seen may end, (n,); 0 where none is.

    Outlines of everything count, hidden ones too: beyond an inner edge another face is seen, which may hide less.
    """
    hits = hits_of(scene, points)
    sight, screens = sight_from_eye(hits.view, hits.directions), no_screens(len(points), hides_touching=False)
    distances = np.full(len(points), np.inf)
    objects = hits.rows[Stage.OBJECT]
    meshes = np.zeros(len(points), dtype=bool)
    for index, shape in enumerate(scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, Ellipsoid):
            distances = np.minimum(distances, ellipsoid_distances(sight, surface, screens))
        elif isinstance(surface, Polygons):
            borders = borders_of(shape)
            whole = _unclipped(scene, borders.hulls)
            counted = borders.outlines_from(hits.view.eye) | ~whole
            distances = np.minimum(distances, edge_distances(sight, borders, counted, screens))
            here = np.flatnonzero(objects[:, 0] == index)
            faces = np.searchsorted(surface.numbers, objects[here, 1])
            if isinstance(shape, Mesh):
                meshes[here] = _unclipped(scene, surface.corners)[np.minimum(faces, len(surface.corners) - 1)]
    return np.where(meshes, distances, 0.0)


def _unclipped(scene: Scene, corners: np.ndarray) -> np.ndarray:
    """Return which hulls of corners (n, corners, 3) lie wholly within the clip interval, (n,)."""
    near, far = (0.0, np.inf) if scene.clip == "none" else (scene.camera.near, scene.camera.far)
    view = view_of(scene.camera)
    away = corners - view.eye
    # No farther along the axis than straight: both kinds of clip interval hold what this one does.
    within = (away @ view.forward > near * (1 + CLIPPED)) & (length(away) < far * (1 - CLIPPED))
    return np.asarray(within.all(axis=1))


def _faces_near(scene: Scene, index: int, points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (k,) which of the points a face of a mesh comes near, and (k, 2, 2) image points on each such face."""
    shape, view = scene.shapes[index], view_of(scene.camera)
    surface = surface_of(shape)
    if not isinstance(shape, Mesh) or not isinstance(surface, Polygons) or not len(surface.corners):
        return np.zeros(0, dtype=int), np.zeros((0, 2, 2))
    away = surface.corners - view.eye
    # What reaches behind the eye has no image as a polygon.
    ahead = np.flatnonzero((away @ view.forward > 0).all(axis=1))
    images = _image_of(view, away[ahead])
    lows, highs = images.min(axis=1), images.max(axis=1)
    margins = radius * (np.linalg.norm(view.across) + np.linalg.norm(view.down))
    rows, places = [np.zeros(0, dtype=int)], [np.zeros((0, 2, 2))]
    for rays, faces in bundles(view.directions(points), away[ahead], margins):
        # Most faces that come so near in the bundle are nowhere near the point itself.
        reach = radius[rays, np.newaxis, np.newaxis]
        there = points[rays, np.newaxis]
        boxed = (there >= lows[faces] - reach) & (there <= highs[faces] + reach)
        row, column = np.nonzero(boxed.all(axis=2))
        ray, face = rays[row], faces[column]
        corners = images[face]
        nearest = _nearest(points[ray], corners)
        near = length(nearest - points[ray]) <= radius[ray]
        ray, nearest = ray[near], nearest[near]
        inward = corners[near].mean(axis=1) - nearest
        size = length(inward)
        step = np.divide(np.minimum(radius[ray], size), size, out=np.zeros_like(size), where=size > 0)
        rows.append(ray)
        inward = inward * step[:, np.newaxis]
        places.append(np.stack([nearest + inward / 2, nearest + inward], axis=1))
    return np.concatenate(rows), np.concatenate(places)


def _image_of(view: View, away: np.ndarray) -> np.ndarray:
    """Return the image points (..., 2) [px] of points (..., 3) relative to the eye [m]."""
    offset = away / (away @ view.forward)[..., np.newaxis] - view.corner
    return np.stack([offset @ axis / (axis @ axis) for axis in (view.across, view.down)], axis=-1)


def _nearest(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the point (k, 2) of each convex polygon (k, corners, 2) that is nearest to its own point (k, 2)."""
    edges = np.roll(corners, -1, axis=1) - corners
    offsets = points[:, np.newaxis] - corners
    sides = edges[..., 0] * offsets[..., 1] - edges[..., 1] * offsets[..., 0]
    inside = np.asarray((sides >= 0).all(axis=1) | (sides <= 0).all(axis=1))
    squared = dot(edges, edges)
    along = np.divide(dot(offsets, edges), squared, out=np.zeros_like(squared), where=squared > 0)
    candidates = corners + edges * np.clip(along, 0, 1)[..., np.newaxis]
    best = length(candidates - points[:, np.newaxis]).argmin(axis=1)
    return np.where(inside[:, np.newaxis], points, candidates[np.arange(len(points)), best])


@dataclass(frozen=True, kw_only=True)
class Near:
    """Lower bounds of how near to n image points something else is."""

    shadows: np.ndarray  # (n, lights) px: on the surface seen, to where a shadow of a light begins or ends
    seams: np.ndarray  # (n, lights) px: to where the way to a light meets an edge inside a mesh that hides it
    gaps: np.ndarray  # (n,) m: along the ray from what is seen to the nearest other surface


def near(scene: Scene, points: np.ndarray) -> Near:
    """Return how near to image points (n, 2) [px] shadows, inner edges of blockers and other surfaces are."""
    hits = hits_of(scene, points)
    shadows, seams = np.full((2, len(points), len(scene.lights)), np.inf)
    for column, light in enumerate(scene.lights):
        shadows[:, column] = shadow_distances(hits, light)
        source = np.asarray(light.position, dtype=np.float64)
        sight = sight_from_light(source, hits.view, hits.directions, hits.sheet)
        screens = hits.screens(source, np.arange(len(points)), from_eye=False)
        for shape in scene.shapes:
            if isinstance(shape, Mesh):
                borders = borders_of(shape)
                inner = ~borders.outlines_from(source)
                seams[:, column] = np.minimum(seams[:, column], edge_distances(sight, borders, inner, screens))
    return Near(shadows=shadows, seams=seams, gaps=next_depths(hits, meetings_of(hits))[0])
