"""The specification's shapes as surfaces of polygons in world space, for looking at."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle

# Four corners of each side, counter-clockwise seen from outside; bit i of a corner's number is its place on axis i.
CUBE_SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Polygons of equally many corners; without `normals` each is flat."""

    points: np.ndarray  # (n, 3) m
    cells: np.ndarray  # (m, corners) numbers of points
    normals: np.ndarray | None = None  # (n, 3) unit


def surface(shape: Shape, *, around: int, most: int, patch: np.ndarray | None = None, margin: float = 0.0) -> Surface:
    """Return `shape` in world space; of a plane the part around the world points `patch`, `margin` [m] wider.

    `around` is the number of corners of a sphere's equator. A mesh of more than `most` triangles is thinned.
    """
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Triangle | Mesh):
        own = thinned(shape.vertices[shape.faces], most) if isinstance(shape, Mesh) else np.asarray(shape.vertices)
        corners = own.reshape(-1, 3).astype(np.float64)
        return Surface(points=corners @ linear.T + offset, cells=np.arange(len(corners)).reshape(-1, 3))
    if isinstance(shape, Sphere):
        unit = ball(around)
        points = (np.asarray(shape.center) + shape.radius * unit.points) @ linear.T + offset
        normals = unit.points @ np.linalg.inv(linear)  # by the inverse transpose
        # A mirrored ball would turn its dark side to whoever looks.
        cells = unit.cells if np.linalg.det(linear) > 0 else unit.cells[:, ::-1]
        return Surface(points=points, cells=cells, normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True))
    if isinstance(shape, Cube):
        corners = np.asarray([[(number >> axis & 1) - 0.5 for axis in range(3)] for number in range(8)])
        return Surface(points=corners @ linear.T + offset, cells=np.asarray(CUBE_SIDES))
    low, high = np.full(2, -0.5), np.full(2, 0.5)
    if isinstance(shape, Plane):
        assert patch is not None, "an infinite plane needs points to be drawn around"
        low, high = _patch(matrix, patch, margin)
    elif not isinstance(shape, Square):
        raise TypeError(f"there is no surface of {type(shape).__name__}")
    corners = np.asarray([(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)])
    return Surface(points=corners @ linear.T + offset, cells=np.asarray([[0, 1, 2, 3]]))


def ball(around: int) -> Surface:
    """Return the unit sphere by `around` meridians and half as many circles of latitude; its points are its normals."""
    rings = around // 2
    theta = (np.pi * np.arange(rings + 1) / rings)[:, None]
    phi = 2 * np.pi * np.arange(around) / around
    points = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    ).reshape(-1, 3)
    ring, place = np.divmod(np.arange(rings * around), around)
    here, beside = ring * around + place, ring * around + (place + 1) % around
    cells = np.stack([here, here + around, beside + around, beside], axis=-1)
    return Surface(points=points, cells=cells, normals=points)


def _patch(matrix: np.ndarray, patch: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners, in the plane's own space, of the part below those points that lie on it, else below all."""
    inverse = np.linalg.inv(matrix)
    local = np.asarray(patch, dtype=np.float64) @ inverse[:3, :3].T + inverse[:3, 3]
    on = local[np.abs(local[:, 2]) < 1e-3 * max(1.0, float(np.abs(local).max()))]
    # A grazing view has hits out to the horizon: the middle nine tenths are what is worth seeing.
    low, high = np.quantile((on if len(on) else local)[:, :2], (0.05, 0.95), axis=0)
    # The margin is a world length; the plane's own axes may be scaled.
    scale = np.linalg.norm(matrix[:3, :2], axis=0)
    return low - margin / scale, high + margin / scale


def thinned(corners: np.ndarray, most: int) -> np.ndarray:
    """Return triangles (faces, 3, 3) that look like the given ones, where these are more than about `most`.

    Corners in one cell of a grid become the first of them, and triangles of which two corners do so are left out. Where
    hardly any is left, for all are smaller than a cell and lie apart, some of them stand for all.
    """
    if len(corners) <= most:
        return corners
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    cells = max(2, int((most / 6) ** 0.5))  # along the longest side: a surface meets about three times its square
    scale = cells / (float((high - low).max()) or 1.0)
    places = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        places = places * (cells + 1) + ((points[:, axis] - low[axis]) * scale).astype(np.int64)
    _, first, number = np.unique(places, return_index=True, return_inverse=True)
    faces = number.reshape(-1, 3)
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if len(faces) < most // 100:
        return corners[:: -(-len(corners) // most)]
    ordered = np.sort(faces, axis=1)
    once = np.unique((ordered[:, 0] * len(first) + ordered[:, 1]) * len(first) + ordered[:, 2], return_index=True)[1]
    return points[first[faces[np.sort(once)]]]
