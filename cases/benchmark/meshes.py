"""Meshes of any size: a bumpy ball, a ball of slivers beside crumbs, and a ball as a laser scan would see it."""

from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Mesh, Rgb

ALBEDO: Rgb = (0.7, 0.5, 0.3)
SEED = 6


@lru_cache(maxsize=1)
def bumpy(subdivisions: int) -> Mesh:
    """Return a subdivided icosahedron (20 x 4^subdivisions triangles) with bumps of three sizes, about 1 m across."""
    vertices, faces = _icosphere(subdivisions)
    x, y, z = vertices.T
    coarse = 0.15 * np.sin(7 * x + 1) * np.sin(9 * y) * np.sin(8 * z + 2)
    fine = 0.03 * np.sin(31 * x) * np.sin(29 * y + 1) * np.sin(33 * z)
    return _mesh(vertices * (1 + coarse + fine)[:, np.newaxis], faces)


@lru_cache(maxsize=1)
def uneven(count: int) -> Mesh:
    """Return about `count` triangles of one ball: long slivers from pole to pole, and a cap of tiny ones.

    A tree that splits space or triangles evenly is at its worst here.
    """
    slivers = count // 2
    longitudes = np.linspace(0, 2 * np.pi, slivers // 2 + 1)[:-1]
    rings = [_ring(longitudes, latitude) for latitude in (-1.2, 0.0, 1.2)]
    vertices = np.concatenate(rings)
    n = len(longitudes)
    this, following = np.arange(n), np.roll(np.arange(n), -1)
    lower = np.concatenate(
        [np.stack([this, following, this + n], 1), np.stack([following, following + n, this + n], 1)]
    )
    faces = np.concatenate([lower, lower + n])
    cap, triangles = _icosphere(max(1, round(np.log2(max(1, count // 2 / 20)) / 2)), radius=0.15)
    tiny = cap + np.array([0.35, -0.7, 0.75])
    return _mesh(np.concatenate([vertices, tiny]), np.concatenate([faces, triangles + len(vertices)]))


@lru_cache(maxsize=1)
def scanned(subdivisions: int) -> Mesh:
    """Return a ball as a scanner delivers it: noisy, with holes, its triangles in no order."""
    random = np.random.default_rng(SEED)
    vertices, faces = _icosphere(subdivisions)
    x, y, z = vertices.T
    shape = 1 + 0.2 * np.sin(3 * x) * np.cos(4 * y + z)
    noise = 0.15 * np.sqrt(4 * np.pi / len(faces)) * random.normal(size=len(x))  # of a triangle's size
    centers = vertices[faces].mean(axis=1)
    holes = (np.sin(9 * centers[:, 0]) * np.sin(8 * centers[:, 1]) * np.sin(7 * centers[:, 2])) > 0.7
    return _mesh(vertices * (shape + noise)[:, np.newaxis], random.permutation(faces[~holes]))


def _icosphere(subdivisions: int, *, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices [m] and faces of a subdivided icosahedron."""
    import trimesh  # here, because it takes most of a second and most scenes have no mesh

    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(ball.vertices), np.asarray(ball.faces)


def _ring(longitudes: np.ndarray, latitude: float) -> np.ndarray:
    return np.stack(
        [
            np.cos(latitude) * np.cos(longitudes),
            np.cos(latitude) * np.sin(longitudes),
            np.full_like(longitudes, np.sin(latitude)),
        ],
        axis=1,
    )


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(albedo=ALBEDO, two_sided=True, vertices=vertices.astype(np.float32), faces=faces.astype(np.int32))
