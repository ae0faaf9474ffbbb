"""From the scene's shapes to implicit surfaces in world space, and their world normals (NRM-3)."""

from functools import lru_cache

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.planes import Flat
from rayproof.reference.analytic.polygons import Polygons
from rayproof.reference.analytic.vectors import cross, length

Surface = Ellipsoid | Flat | Polygons

# Corners of the cube's faces by the bits of x, y, z (0: -0.5, 1: +0.5), going around each face.
CUBE_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@lru_cache(maxsize=256)
def surface_of(shape: Shape) -> Surface:
    """Return the shape's surface in world space; raise TypeError for a kind of shape that is not known."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        axes = linear * shape.radius
        return Ellipsoid(
            center=linear @ np.asarray(shape.center) + offset, axes=axes, to_unit=np.linalg.inv(linear) / shape.radius
        )
    if isinstance(shape, Plane):
        return Flat(point=offset, normal=_units(np.linalg.inv(linear)[2]))
    if isinstance(shape, Square):
        corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
        return Polygons(corners=(corners @ linear.T + offset)[np.newaxis], numbers=np.zeros(1), closed=False)
    if isinstance(shape, Cube):
        bits = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)])
        corners = (bits - 0.5) @ linear.T + offset
        return Polygons(corners=corners[np.array(CUBE_FACES)], numbers=np.zeros(6), closed=True)
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        faces = Polygons(corners=corners, numbers=np.arange(len(corners)), closed=True)
        # A face without area is never hit, whether it had none before baking or lost it then.
        area = faces.normals.any(axis=1) & _winding_normals(shape).any(axis=1)
        return Polygons(corners=corners[area], numbers=np.flatnonzero(area), closed=True)
    raise TypeError(f"analytic knows no shape {type(shape).__name__}")


def outward_normals(shape: Shape, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit world normals (N, 3) at points (N, 3) [m] on the given faces (N,): never turned towards a viewer.

    A cube's face is the one whose object coordinate is greatest in magnitude; of equal ones x comes before y before z.
    """
    surface = surface_of(shape)
    if isinstance(surface, Ellipsoid):
        return _units(surface.normals(points))
    inverse = np.linalg.inv(np.asarray(shape.to_world, dtype=np.float64)[:3, :3])
    if isinstance(shape, Cube):
        local = cube_points(shape, points)
        axis = np.abs(local).argmax(axis=1)
        sign = np.where(np.take_along_axis(local, axis[:, np.newaxis], axis=1) < 0, -1.0, 1.0)
        return _units(inverse[axis] * sign)
    if isinstance(shape, Triangle | Mesh):
        winding = _winding_normals(shape)
        # A number that is no face's, or no number, comes from a renderer under test: any answer will show it.
        known = np.clip(np.nan_to_num(faces), 0, len(winding) - 1)
        return _units(winding[known.astype(int)] @ inverse)
    return np.broadcast_to(_units(inverse[2]), points.shape)


def cube_points(shape: Cube, points: np.ndarray) -> np.ndarray:
    """Return world points (N, 3) [m] in the cube's object space, where it is [-0.5, 0.5]^3."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T


@lru_cache(maxsize=64)
def _winding_normals(shape: Triangle | Mesh) -> np.ndarray:
    """Return object-space normals by winding, of any length, shape (faces, 3)."""
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    else:
        corners = shape.vertices.astype(np.float64)[shape.faces]
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _units(vectors: np.ndarray) -> np.ndarray:
    """Return vectors scaled to unit length, along the last axis."""
    with np.errstate(all="ignore"):
        scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
        return scaled / length(scaled)[..., np.newaxis]
