"""Triangles and meshes, on the host and as traced: object normals, degenerate faces, slenderness.

Meshes are large: they are worked through in pieces that stay in the cache, by several threads, component by component.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import IDENTITY, Mesh, Shape, Triangle, Vector
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.shape import TracedShape

PIECE = 2**14  # triangles
THREADS = min(8, os.cpu_count() or 1)  # numpy's long operations release the interpreter lock
Corners = np.ndarray  # (3, 3, n) float64 [m]: corner, axis, triangle


def in_pieces(count: int, work: Callable[[slice], None]) -> None:
    """Call `work` with slices that cover `count` items, in parallel if there are several slices."""
    pieces = [slice(start, min(start + PIECE, count)) for start in range(0, count, PIECE)]
    if len(pieces) < 2:
        for piece in pieces:
            work(piece)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(work, pieces))


def _count(shape: Shape) -> int:
    if isinstance(shape, Triangle):
        return 1
    if isinstance(shape, Mesh):
        return len(shape.faces)
    raise TypeError(f"{type(shape).__name__} has no triangles")


def _rows(shape: Shape, piece: slice) -> np.ndarray:
    """Return object-space corners [m] as rows of nine numbers, float32 or, of a triangle, float64."""
    if isinstance(shape, Mesh):
        return shape.vertices.take(shape.faces[piece].reshape(-1), axis=0).reshape(-1, 9)
    assert isinstance(shape, Triangle)
    return np.asarray(shape.vertices, dtype=np.float64).reshape(-1, 9)[piece]


def baked(shape: Shape, piece: slice = slice(None)) -> np.ndarray:
    """Return world-space corners [m], float32 rows of nine; at identity they are made anew, not kept."""
    if isinstance(shape, Mesh) and shape.to_world == IDENTITY:
        return _rows(shape, piece)
    return world_triangles(shape).reshape(-1, 9)[piece]


def _corners(rows: np.ndarray) -> Corners:
    return np.ascontiguousarray(rows.T, dtype=np.float64).reshape(3, 3, -1)


def _doubled_areas(corners: Corners) -> np.ndarray:
    """Return the cross product of two edges [m^2], (3, n): by winding, its length is twice the area."""
    (ux, uy, uz), (vx, vy, vz) = corners[1] - corners[0], corners[2] - corners[0]
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])


def shadows(corners: Corners) -> np.ndarray:
    """Return the area of each triangle's projections along the three axes together [m^2], (n,)."""
    return abs(_doubled_areas(corners)).sum(axis=0) / 2


@lru_cache(maxsize=16)
def layers(meshes: tuple[Mesh, ...]) -> float:
    """Return the number of layers of meshes in their box: the area of their projections over half that of the box."""
    rows = np.concatenate([baked(mesh) for mesh in meshes])
    layers: list[float] = []
    ends: list[np.ndarray] = []

    def work(piece: slice) -> None:
        corners = _corners(rows[piece])
        layers.append(float(shadows(corners).sum()))
        ends.append(np.stack([corners.min(axis=(0, 2)), corners.max(axis=(0, 2))]))

    in_pieces(len(rows), work)
    x, y, z = np.max([high for _, high in ends], axis=0) - np.min([low for low, _ in ends], axis=0)
    box = float(x * y + y * z + z * x)
    return sum(layers) / box if box > 0 else 0.0


def reaches(shape: Shape, dtype: Any = np.float64) -> np.ndarray:
    """Return (faces,) the distance of each triangle's farthest corner from the world's origin [m]."""
    extents = np.empty(_count(shape), dtype=dtype)

    def work(piece: slice) -> None:
        x, y, z = np.moveaxis(_corners(baked(shape, piece)), 1, 0)
        extents[piece] = np.sqrt((x * x + y * y + z * z).max(axis=0))

    in_pieces(len(extents), work)
    return extents


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(vectors[0] * vectors[0] + vectors[1] * vectors[1] + vectors[2] * vectors[2])


def object_normals(shape: Shape, dtype: Any = np.float64) -> np.ndarray:
    """Return unit object-space normals by counter-clockwise winding, (faces, 3); of degenerate triangles (0, 0, 0)."""
    normals = np.empty((_count(shape), 3), dtype=dtype)

    def work(piece: slice) -> None:
        areas = _doubled_areas(_corners(_rows(shape, piece)))
        lengths = _length(areas)
        normals[piece] = np.divide(areas, lengths, out=np.zeros_like(areas), where=lengths > 0).T

    in_pieces(len(normals), work)
    return normals


def degenerate(shape: Shape) -> np.ndarray:
    """Return (faces,) booleans: no area in object space, or none left after the corners were rounded in world space."""
    flags = np.empty(_count(shape), dtype=bool)

    def work(piece: slice) -> None:
        kept = np.any(_doubled_areas(_corners(_rows(shape, piece))), axis=0)
        if not (isinstance(shape, Mesh) and shape.to_world == IDENTITY):
            kept &= np.any(_doubled_areas(_corners(baked(shape, piece))), axis=0)
        flags[piece] = ~kept

    in_pieces(len(flags), work)
    return flags


def slenderness(shape: Shape, dtype: Any = np.float64) -> np.ndarray:
    """Return (faces,) the product of two edges over twice the area, at least 1: a factor of rounding errors."""
    ratios = np.empty(_count(shape), dtype=dtype)

    def work(piece: slice) -> None:
        corners = _corners(baked(shape, piece))
        edges = _length(corners[1] - corners[0]) * _length(corners[2] - corners[0])
        areas = _length(_doubled_areas(corners))
        ratios[piece] = np.divide(edges, areas, out=np.ones_like(edges), where=areas > 0)

    in_pieces(len(ratios), work)
    return ratios


@dataclass(frozen=True, kw_only=True)
class TriangleArrays:
    """A triangle by its corners in world space."""

    first: Any  # m
    second: Any  # m
    third: Any  # m


class _OfTriangles(TracedShape):
    """The common base of triangle and mesh."""

    slot = "triangle"

    def spreads(self) -> np.ndarray:
        """Return the slenderness of each triangle."""
        return slenderness(self.shape)

    def reaches(self) -> np.ndarray:
        """Return the distance of each triangle's farthest corner from the world's origin [m]."""
        return reaches(self.shape)


@dataclass(frozen=True)
class TracedTriangle(_OfTriangles):
    """A triangle, which is in world space from the beginning."""

    own_normal = True

    @property
    def magnified(self) -> float:
        """Return 1: no point is transformed to object space."""
        return 1.0

    @property
    def flat_normal(self) -> Vector:
        """Return its normal in object space."""
        x, y, z = map(float, object_normals(self.shape)[0])
        return x, y, z

    @property
    def empty(self) -> bool:
        """Return whether it is degenerate."""
        return bool(degenerate(self.shape)[0])

    def arrays(self, types: ArrayTypes) -> TriangleArrays:
        """Return its corners as literals."""
        first, second, third = (types.Vector(*map(float, corner)) for corner in world_triangles(self.shape)[0])
        return TriangleArrays(first=first, second=second, third=third)

    @property
    def ball(self) -> tuple[np.ndarray, float]:
        """Return its centre of gravity and the distance to the farthest corner [m]."""
        corners = world_triangles(self.shape)[0].astype(np.float64)
        center = corners.mean(axis=0)
        return center, float(np.linalg.norm(corners - center, axis=1).max())


@dataclass(frozen=True)
class TracedMesh(_OfTriangles):
    """A mesh, whose triangles are in a tree."""

    single = False

    @property
    def can_shadow_itself(self) -> bool:
        """Return True."""
        return True

    @staticmethod
    def normal(shapes: Any, point: Any) -> Any:
        """Return the object-space normals of the triangles that were hit (`tracer.light_path.surfaces`)."""
        forest = shapes.world.trees.forest
        return (
            shapes.world.types.Vector(0)
            if forest is None
            else forest.normal(shapes.hit.number, shapes.kind(TracedMesh))
        )
