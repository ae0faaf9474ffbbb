"""Distance in the image to shadow edges and terminators, for each light."""

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.edges.hits import Hits
from rayproof.reference.analytic.edges.inverse_depths import COARSE, ROUNDING, reach
from rayproof.reference.analytic.edges.outlines import borders_of, edge_distances, ellipsoid_distances, sight_from_light
from rayproof.reference.analytic.light import above_horizon, blocked_by_itself
from rayproof.reference.analytic.surfaces import Ellipsoid, Polygons, surface_of
from rayproof.reference.analytic.vectors import Flat, dot, length

# Of coordinates: by so much a blocker is higher than the light whatever rounding does, 1e-6 of them in float32.
HIGHER = 1e-4


def shadow_distances(hits: Hits, light: PointLight) -> np.ndarray:
    """Return a lower bound [px] of the distance to where a blocker's shadow begins or ends, shape (N,).

    Infinite below the horizon and where a convex shape's own body stands before the light: neither can change but at
    the terminator or the silhouette. An infinite plane's shadow ends only where the plane meets the surface, which is
    a silhouette.
    """
    source = np.asarray(light.position, dtype=np.float64)
    distances = np.full(len(hits.directions), np.inf)
    rays = np.flatnonzero(_asked(hits, source))
    if not len(rays):
        return distances
    sight = sight_from_light(source, hits.view, hits.directions[rays], hits.sheet[rays])
    screens = hits.screens(source, rays, from_eye=False)
    nearest = np.full(len(rays), np.inf)
    for index, shape in enumerate(hits.scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, Flat):
            continue
        if isinstance(surface, Ellipsoid):
            blocker = ellipsoid_distances(sight, surface, screens)
        else:
            borders = borders_of(shape)
            blocker = edge_distances(sight, borders, borders.outlines_from(source, COARSE), screens)
        if isinstance(surface, Ellipsoid) or isinstance(shape, Cube):
            blocker[hits.rows[Stage.OBJECT][rays, 0] == index] = np.inf
        blocker[_higher_than(source, hits, rays, surface)] = np.inf
        nearest = np.minimum(nearest, blocker)
    distances[rays] = nearest
    return distances


def _higher_than(source: np.ndarray, hits: Hits, rays: np.ndarray, surface: Ellipsoid | Polygons) -> np.ndarray:
    """Return which rays (N,) see a flat shape above which the surface begins higher than the light: it throws nothing.

    Wherever on that shape a feeler starts, it stays below the light.
    """
    higher = np.zeros(len(rays), dtype=bool)
    for index, shape in enumerate(hits.scene.shapes):
        members = np.flatnonzero(hits.rows[Stage.OBJECT][rays, 0] == index)
        if not isinstance(shape, Plane | Square) or not len(members):
            continue
        point, normal = hits.points[rays[members[0]]], hits.normals[rays[members[0]]]
        normal = normal / np.linalg.norm(normal)
        height = float(normal @ (source - point))
        if isinstance(surface, Ellipsoid):
            middle, half = float(normal @ (surface.center - point)), float(np.linalg.norm(surface.axes.T @ normal))
            heights = np.array([middle - half, middle + half])
        else:
            heights = (surface.corners.reshape(-1, 3) - point) @ normal
        size = max(float(np.abs(place).max(initial=0.0)) for place in (source, point, heights))
        higher[members] = (heights * np.sign(height)).min(initial=np.inf) > abs(height) + HIGHER * size
    return higher


def _asked(hits: Hits, source: np.ndarray) -> np.ndarray:
    """Return which rays' visibility of the light hangs on other shapes, shape (N,)."""
    positions, normals = hits.rows[Stage.POSITION], hits.rows[Stage.NORMAL]
    asked = (hits.rows[Stage.OBJECT][:, 0] >= 0) & above_horizon(source, positions, normals)
    for index in range(len(hits.scene.shapes)):
        here = hits.of(index)
        asked[here] &= ~blocked_by_itself(hits.scene, index, source, positions[here])
    return asked


def terminator_distances(hits: Hits, light: PointLight) -> np.ndarray:
    """Return a lower bound [px] of the distance to where dot(N, L) changes sign, shape (N,).

    On a flat surface it never does; 0 where the light lies in its plane. A triangle's normal is not exactly that of its
    baked corners, so there it may, far away.
    """
    source = np.asarray(light.position, dtype=np.float64)
    distances = np.full(len(hits.directions), np.inf)
    steps = np.stack([hits.view.across, hits.view.down], axis=1)
    for index, shape in enumerate(hits.scene.shapes):
        members, surface = hits.of(index), surface_of(shape)
        sheet, directions = hits.sheet[members], hits.directions[members]
        if isinstance(surface, Ellipsoid):
            # The polar plane of the light: y.s = 1 in unit-sphere space; here times w.
            polar = surface.to_unit @ (source - surface.center)
            vectors = np.broadcast_to(surface.to_unit.T @ polar, directions.shape)
            lever = np.full(len(members), polar @ (surface.to_unit @ (hits.view.eye - surface.center)) - 1)
        else:
            vectors = hits.rows[Stage.NORMAL][members]
            lever = vectors @ (hits.view.eye - source)
        value = lever * sheet.value + dot(vectors, directions)
        if isinstance(surface, Ellipsoid) or isinstance(shape, Triangle | Mesh):
            gradient = lever[:, np.newaxis] * sheet.gradient + vectors @ steps
            bend = np.abs(lever) * sheet.bend
            distances[members] = reach(value, length(gradient), bend, sheet.radius)
        else:
            height = dot(source - hits.points[members], vectors)
            size = np.abs(source).max() + np.abs(hits.points[members]).max(axis=1)
            distances[members] = np.where(np.abs(height) <= ROUNDING * size, 0, np.inf)
    return distances
