"""Laws of shapes: one shape replaced by another or by parts: squares by tiles, cubes by squares, meshes split."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws.relations import (
    Ask,
    Conditions,
    Relation,
    coincide,
    has_triangles,
    placed,
    related,
    with_shapes,
)
from rayproof.cases.placement import compose, matrix, rotation, scaling, translation
from rayproof.cases.scene import Cube, Matrix, Mesh, Plane, Scene, Shape, Square, Triangle
from rayproof.cases.stages import Stage

# A square is nine smaller ones.
THIRDS = (-1 / 3, 0.0, 1 / 3)


def pieces(scene: Scene) -> tuple[Scene, np.ndarray]:
    """Return the scene with every square as nine, and which shape each new one was."""
    shapes: list[Shape] = []
    owners: list[int] = []
    for index, shape in enumerate(scene.shapes):
        tiles: tuple[Shape, ...] = (shape,)
        if isinstance(shape, Square):
            small = scaling(1 / 3, 1 / 3, 1)
            tiles = tuple(placed(shape, compose(translation(x, y, 0), small)) for y in THIRDS for x in THIRDS)
        shapes += tiles
        owners += [index] * len(tiles)
    return replace(scene, shapes=tuple(shapes)), np.array([*owners, -1])


def square_tiles(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Lay every square out with nine tiles: nothing changes but which one is seen.

    Proof: the nine tile it, in its plane and facing as it does; a seam is met by no pixel but by chance.
    Source: specification, HIT-7.
    """
    if any(isinstance(shape, Square) for shape in scene.shapes) and not coincide(scene):
        changed, owners = pieces(scene)

        def owned(image: np.ndarray) -> np.ndarray:
            return np.stack([owners[image[..., 0].astype(int)].astype(float), image[..., 1]], axis=-1)

        yield from related(
            ask,
            scene,
            changed,
            what="every square laid out with nine",
            after={Stage.OBJECT: owned},
            conditions=Conditions(factor=3.0),
        )


# A square is two triangles.
SQUARE_CORNERS = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0))


def _mesh_for(shape: Shape, vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """Return a mesh in the place of a shape, with its albedo and sidedness."""
    return Mesh(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided, vertices=vertices, faces=faces)


def halves(shape: Shape) -> Shape:
    """Return a square as two triangles."""
    if not isinstance(shape, Square):
        return shape
    return _mesh_for(shape, np.array(SQUARE_CORNERS), np.array([(0, 1, 2), (0, 2, 3)]))


def square_triangles(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Make a mesh of two triangles of every square: nothing changes but which face is seen.

    Proof: the two tile it, in its plane, wound so that they face +z. Source: specification, HIT-6 and HIT-7.
    """
    if any(isinstance(shape, Square) for shape in scene.shapes) and not coincide(scene):
        changed = with_shapes(scene, halves)
        square = np.array([isinstance(shape, Square) for shape in scene.shapes] + [False])

        def without_faces(image: np.ndarray) -> np.ndarray:
            return np.stack([image[..., 0], np.where(square[image[..., 0].astype(int)], 0, image[..., 1])], axis=-1)

        yield from related(
            ask,
            scene,
            changed,
            what="every square made of two triangles",
            after={Stage.OBJECT: without_faces},
            conditions=Conditions(rebaked=True),
        )


# As far as one can see, a plane is a large square.
def plane_square(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a square in every plane's place that reaches beyond the far plane and every light: nothing changes.

    Proof: nothing is seen beyond the far plane, and feelers run between what is seen and the lights, all of it within
    the square. Source: specification, HIT-4 and HIT-7.
    """
    if scene.clip == "none" or not any(isinstance(shape, Plane) for shape in scene.shapes):
        return
    camera = scene.camera
    reach = camera.far * np.hypot(1, np.tan(camera.alpha) * max(1.0, camera.aspect) * 1.5) + max(
        (float(np.linalg.norm(np.subtract(light.position, camera.eye))) for light in scene.lights), default=0.0
    )

    def bounded(shape: Shape) -> Shape:
        if not isinstance(shape, Plane):
            return shape
        inverse = np.linalg.inv(np.asarray(shape.to_world))
        center = inverse[:3, :3] @ np.asarray(camera.eye) + inverse[:3, 3]
        size = float(4 * reach * np.linalg.norm(inverse[:3, :3], ord=2))
        there = compose(translation(float(center[0]), float(center[1]), 0), scaling(size, size, 1))
        square = Square(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided)
        return placed(square, matrix(there))

    # Local coordinates are small, but the matrix stretches by the square's size: what is rounded are plane distances.
    yield from related(
        ask, scene, with_shapes(scene, bounded), what="every plane cut to a large square", conditions=Conditions()
    )


# A cube is six squares.
def cube_sides() -> tuple[Matrix, ...]:
    """Return the six placements of a square, facing outward on the unit cube."""
    turns = [rotation((1, 0, 0), angle) for angle in (0, 90, 180, 270)]
    turns += [rotation((0, 1, 0), angle) for angle in (90, 270)]
    # Whole numbers, so that each side lies exactly in its plane.
    return tuple(matrix(np.round(compose(turn, translation(0, 0, 0.5)), 6)) for turn in turns)


def cube_squares(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put six squares that face outward in every cube's place: nothing changes but which shape is seen.

    Proof: the six are the cube's surface, and a ray meets it first where it meets the first of them.
    Source: specification, HIT-3 and HIT-7.
    """
    if any(isinstance(shape, Cube) for shape in scene.shapes) and not coincide(scene):
        shapes: list[Shape] = []
        owners: list[int] = []
        for index, shape in enumerate(scene.shapes):
            made: tuple[Shape, ...] = (shape,)
            if isinstance(shape, Cube):
                made = tuple(
                    Square(
                        albedo=shape.albedo,
                        to_world=matrix(np.asarray(shape.to_world) @ np.asarray(side)),
                        two_sided=shape.two_sided,
                    )
                    for side in cube_sides()
                )
            shapes += made
            owners += [index] * len(made)
        numbers = np.array([*owners, -1], dtype=float)

        def owned(image: np.ndarray) -> np.ndarray:
            return np.stack([numbers[image[..., 0].astype(int)], image[..., 1]], axis=-1)

        changed = replace(scene, shapes=tuple(shapes))
        yield from related(ask, scene, changed, what="every cube made of six squares", after={Stage.OBJECT: owned})


# A cube is twelve triangles.
CUBE_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
CUBE_QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # seen from outside
CUBE_FACES = np.array([half for a, b, c, d in CUBE_QUADS for half in ((a, b, c), (a, c, d))])


def twelve(shape: Shape) -> Shape:
    """Return a cube as a mesh."""
    if not isinstance(shape, Cube):
        return shape
    return Mesh(
        albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided, vertices=CUBE_CORNERS, faces=CUBE_FACES
    )


def cube_triangles(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Make a mesh of twelve triangles of every cube: nothing changes but which face is seen.

    Proof: the twelve are the cube's surface, wound to face outward. Source: specification, HIT-3 and HIT-6.
    """
    if any(isinstance(shape, Cube) for shape in scene.shapes) and not coincide(scene):
        cube = np.array([isinstance(shape, Cube) for shape in scene.shapes] + [False])

        def without_faces(image: np.ndarray) -> np.ndarray:
            return np.stack([image[..., 0], np.where(cube[image[..., 0].astype(int)], 0, image[..., 1])], axis=-1)

        yield from related(
            ask,
            scene,
            with_shapes(scene, twelve),
            what="every cube made of twelve triangles",
            after={Stage.OBJECT: without_faces},
            conditions=Conditions(rebaked=True),
        )


# A triangle is a mesh of one face.
def as_mesh(shape: Shape) -> Shape:
    """Return a triangle as a mesh."""
    if not isinstance(shape, Triangle):
        return shape
    return _mesh_for(shape, np.array(shape.vertices), np.array([(0, 1, 2)]))


def triangle_mesh(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Hand every triangle over as a mesh of one face: nothing changes.

    Proof: both are three float32 corners, baked alike. Source: specification, conventions.
    """
    if any(isinstance(shape, Triangle) for shape in scene.shapes):
        yield from related(ask, scene, with_shapes(scene, as_mesh), what="every triangle handed over as a mesh")


# A mesh is two meshes, each with half of its faces.
def mesh_parts(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Deal every mesh's faces out to two meshes in turn: nothing changes but which of them is seen.

    Proof: the nearest of all faces is the nearer of the nearest of either. Source: specification, HIT-9.
    """
    shapes: list[Shape] = []
    owners: list[tuple[int, int, int]] = []  # the shape that it was, and its face f was step f + first
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Mesh) and len(shape.faces) > 1:
            for first in (0, 1):
                shapes.append(replace(shape, faces=shape.faces[first::2]))
                owners.append((index, 2, first))
        else:
            shapes.append(shape)
            owners.append((index, 1, 0))
    if len(shapes) == len(scene.shapes):
        return
    table = np.array([*owners, (-1, 1, 0)])

    def owned(image: np.ndarray) -> np.ndarray:
        row = table[image[..., 0].astype(int)]
        return np.stack([row[..., 0], row[..., 1] * image[..., 1] + row[..., 2]], axis=-1).astype(float)

    changed = replace(scene, shapes=tuple(shapes))
    yield from related(ask, scene, changed, what="every mesh dealt out to two", after={Stage.OBJECT: owned})


# A triangle is its four quarters.
LARGEST = 4000  # faces that a mesh may have; beyond, its quarters are too small to tell anything


def quartered(shape: Shape) -> Shape:
    """Return a triangle or mesh with every face split at the midpoints of its edges."""
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices)[np.newaxis]
    elif isinstance(shape, Mesh) and len(shape.faces) <= LARGEST:
        corners = shape.vertices.astype(np.float64)[shape.faces]
    else:
        return shape
    a, b, c = (corners[:, index] for index in range(3))
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = np.stack([np.stack(four, axis=1) for four in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], 1)
    vertices = quarters.reshape(-1, 3)
    return _mesh_for(shape, vertices, np.arange(len(vertices)).reshape(-1, 3))


def split(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Split every triangle at its edges' midpoints: the image stays, and face f becomes one of 4 f to 4 f + 3.

    Proof: the four quarters tile the triangle and lie in its plane, wound as it is; only the rounding of midpoints to
    float32 moves them. Source: Loop, Smooth Subdivision Surfaces Based on Triangles (1987), without the smoothing.
    """
    if not has_triangles(scene):
        return
    changed = with_shapes(scene, quartered)
    split_up = np.array([new is not old for new, old in zip(changed.shapes, scene.shapes, strict=True)] + [False])

    def whole(image: np.ndarray) -> np.ndarray:
        index = image[..., 0].astype(int)
        divided = split_up[index] & (image[..., 0] >= 0)
        return np.stack([image[..., 0], np.where(divided, image[..., 1] // 4, image[..., 1])], axis=-1)

    yield from related(
        ask,
        scene,
        changed,
        what="every triangle split into four",
        after={Stage.OBJECT: whole},
        conditions=Conditions(rebaked=True),
    )
