"""Scenes within rounding of a scene: what a renderer that rounds may answer is certified for some scene like these.

That is backward analysis (Wilkinson, 1963; Higham, 2002, section 1.5) by trial: each number that a renderer reads is
moved by a few units of its roundoff, and so is each point that it computes. An answer that the certified arithmetic
gives for a scene that near is one that rounding can bring about. The trials share nothing with the judge's edges.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import IDENTITY, Matrix, Mesh, Scene, Shape, Sphere, Triangle, Vector

CORNERS = 4  # roundings of a corner to float32, as limits of a light's cosine count them: two corners from either side


def perturbed(
    scene: Scene,
    generator: np.random.Generator,
    amount: float,
    *,
    unshared: bool,
    baked: bool = False,
    turned: bool = False,
    corners: float = 0.0,
) -> Scene:
    """Return a scene whose numbers are off by up to `amount` of the length of the vector that they belong to.

    The camera's direction stays, for who perturbs its rays by their image points, unless it is to be `turned` by what
    the target's own rounding does. `unshared` moves the corners of each
    face by themselves, so that a mesh's faces part as much as its rounded vertices may let them; `baked` turns shapes
    by as much as rounding their corners in world space does. Where triangles are placed by a matrix, their corners are
    off by `corners` of their size at least. A negative `amount` moves everything the other way.
    """
    view = scene.camera
    apart = float(np.linalg.norm(np.subtract(view.target, view.eye)))
    moved = _off(generator, view.eye, amount * (float(np.linalg.norm(view.eye)) + apart))
    shift = np.subtract(moved, view.eye)
    target = np.add(view.target, shift)
    if turned:
        target = np.asarray(_off(generator, view.target, amount * (_length(view.target) + apart)))
    return replace(
        scene,
        camera=replace(view, eye=moved, target=(float(target[0]), float(target[1]), float(target[2]))),
        shapes=tuple(
            _shape(shape, generator, _more(shape, amount, corners), unshared=unshared, baked=baked)
            for shape in scene.shapes
        ),
        lights=tuple(
            replace(light, position=_off(generator, light.position, amount * (_length(light.position) + apart)))
            for light in scene.lights
        ),
    )


def as_read(scene: Scene, precision: str) -> Scene:
    """Return the scene whose numbers are rounded once to `precision`, as a renderer reads them.

    Far from the origin that is another scene, and of random ones within rounding few are like it. The corners of
    triangles in the world are rounded once for everybody, and stay.
    """

    def read(numbers: Vector) -> Vector:
        x, y, z = np.asarray(numbers, dtype=precision).tolist()
        return (x, y, z)

    def shape_as_read(shape: Shape) -> Shape:
        if isinstance(shape, Triangle | Mesh):
            return shape
        rows = np.asarray(shape.to_world, dtype=precision).tolist()
        changes: dict[str, object] = {"to_world": tuple(map(tuple, rows))}
        if isinstance(shape, Sphere):
            changes |= {"center": read(shape.center), "radius": float(np.asarray(shape.radius, dtype=precision))}
        return replace(shape, **changes)

    view = scene.camera
    return replace(
        scene,
        camera=replace(view, eye=read(view.eye), target=read(view.target), up=read(view.up)),
        shapes=tuple(map(shape_as_read, scene.shapes)),
        lights=tuple(replace(light, position=read(light.position)) for light in scene.lights),
    )


def horizons(scene: Scene) -> Iterator[Scene]:
    """Yield scenes of which only the corners of placed triangles are rounded to float32 otherwise, in world space."""
    for seed in range(4):
        for way in (1.0, -1.0):
            generator = np.random.default_rng(seed)
            amount = way * UNIT_ROUNDOFF["float64"]
            corners = CORNERS * UNIT_ROUNDOFF["float32"]
            yield perturbed(scene, generator, amount, unshared=False, baked=True, corners=corners)


def _more(shape: Shape, amount: float, corners: float) -> float:
    """Return by how much a shape is off."""
    placed = isinstance(shape, Triangle | Mesh) and shape.to_world != IDENTITY
    return math.copysign(max(abs(amount), corners), amount) if placed else amount


def _length(vector: Vector) -> float:
    return float(np.linalg.norm(vector))


def _off(generator: np.random.Generator, point: Vector, most: float) -> Vector:
    """Return a point moved by up to `most` along each axis."""
    x, y, z = np.asarray(point) + most * generator.uniform(-1, 1, 3)
    return (float(x), float(y), float(z))


def _shape(shape: Shape, generator: np.random.Generator, amount: float, *, unshared: bool, baked: bool) -> Shape:
    changes: dict[str, object] = {"to_world": _matrix(shape.to_world, generator, amount, baked=baked)}
    if isinstance(shape, Sphere):
        size = amount * (_length(shape.center) + shape.radius)
        changes["center"] = _off(generator, shape.center, size)
        changes["radius"] = shape.radius * (1 + amount * float(generator.uniform(-1, 1)))
    elif isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices)
        corners = corners + amount * np.abs(corners).max() * generator.uniform(-1, 1, (3, 3))
        changes["vertices"] = tuple(map(tuple, corners.tolist()))
    elif isinstance(shape, Mesh):
        vertices, faces = shape.vertices.astype(np.float64), shape.faces
        if unshared:
            vertices, faces = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
        changes["vertices"] = vertices + amount * np.abs(vertices).max() * generator.uniform(-1, 1, vertices.shape)
        changes["faces"] = faces
    return replace(shape, **changes)


def _matrix(matrix: Matrix, generator: np.random.Generator, amount: float, *, baked: bool) -> Matrix:
    """Return a matrix whose linear part and whose translation are off by so much of their own size."""
    entries = np.asarray(matrix, dtype=np.float64)
    sizes = np.zeros((4, 4))
    sizes[:3, :3] = np.abs(entries[:3, :3]) if matrix != IDENTITY else 0.0
    if baked:
        sizes[:3, :3] += np.linalg.norm(entries[:3, 3])
    # Points on the surface are off by as much as the shape is large, wherever it stands.
    sizes[:3, 3] = np.linalg.norm(entries[:3, 3]) + np.abs(entries[:3, :3]).sum(axis=1)
    rows = (entries + amount * sizes * generator.uniform(-1, 1, (4, 4))).tolist()
    return (tuple(rows[0]), tuple(rows[1]), tuple(rows[2]), (0.0, 0.0, 0.0, 1.0))
