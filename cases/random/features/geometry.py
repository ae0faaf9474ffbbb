"""Features of shapes: faces and shapes that coincide or touch, matrices of every kind, surfaces of no area."""

from dataclasses import replace
from typing import cast

import numpy as np

from rayproof.cases.placement import compose, rotation, scaling, shear, translation
from rayproof.cases.random.draft import Draft, placement, rgb, shape_of
from rayproof.cases.random.features import FEATURES, Step
from rayproof.cases.scene import Cube, Mesh, Plane, Sphere, Square, Triangle


def _mesh(draft: Draft) -> tuple[int, Mesh]:
    index = draft.any_of(Mesh)
    return index, cast(Mesh, draft.shapes[index])


@FEATURES.register("duplicate_face", step=Step.SHAPES, what="A mesh has faces twice, in the same winding.")
def duplicate_face(draft: Draft) -> None:
    """Repeat one to three faces of a mesh."""
    index, mesh = _mesh(draft)
    chosen = [draft.draws.whole(0, len(mesh.faces) - 1) for _ in range(draft.draws.whole(1, 3))]
    draft.alter(index, faces=np.concatenate([mesh.faces, mesh.faces[chosen]]))


@FEATURES.register("reversed_face", step=Step.SHAPES, what="A mesh has faces twice, in both windings.")
def reversed_face(draft: Draft) -> None:
    """Repeat one to three faces of a mesh with two corners swapped."""
    index, mesh = _mesh(draft)
    chosen = [draft.draws.whole(0, len(mesh.faces) - 1) for _ in range(draft.draws.whole(1, 3))]
    draft.alter(index, faces=np.concatenate([mesh.faces, mesh.faces[chosen][:, [0, 2, 1]]]))


@FEATURES.register("cracked_mesh", step=Step.SHAPES, what="A mesh's faces do not quite meet.")
def cracked_mesh(draft: Draft) -> None:
    """Give one face corners of its own, off by 1e-7 to 1e-2 of their size."""
    index, mesh = _mesh(draft)
    face, gap = draft.draws.whole(0, len(mesh.faces) - 1), draft.draws.logarithmic(1e-7, 1e-2)
    own = mesh.vertices[mesh.faces[face]].astype(np.float64)
    moved = own + gap * (own.mean(axis=0) - own)
    faces = mesh.faces.copy()
    faces[face] = np.arange(3) + len(mesh.vertices)
    draft.alter(index, vertices=np.concatenate([mesh.vertices, moved]), faces=faces)


@FEATURES.register("degenerate_triangle", step=Step.SHAPES, what="A triangle or a face has no area.")
def degenerate_triangle(draft: Draft) -> None:
    """Add a face whose corners lie on a line, or a triangle that is a point or a line."""
    if draft.draws.chance(0.5):
        index, mesh = _mesh(draft)
        face = mesh.faces[draft.draws.whole(0, len(mesh.faces) - 1)]
        draft.alter(index, faces=np.concatenate([mesh.faces, [[face[0], face[1], face[1]]]]))
        return
    start, end = draft.draws.vector(-1, 1), draft.draws.vector(-1, 1)
    triangle = Triangle(albedo=rgb(draft.draws, 0.2, 0.9), vertices=(start, end, draft.draws.choice((start, end))))
    draft.shapes.append(triangle)


@FEATURES.register("coincident_shapes", step=Step.PLACES, what="Two shapes share a surface.")
def coincident_shapes(draft: Draft) -> None:
    """Put a shape where another one is: the same one again, or another kind in the same plane."""
    index = draft.any_of(Sphere, Cube, Square, Triangle, Mesh, Plane)
    shape, colour = draft.shapes[index], rgb(draft.draws, 0.2, 0.9)
    if isinstance(shape, Square | Plane) and draft.draws.chance(0.5):
        corners = ((-0.4, -0.4, 0.0), (0.4, -0.4, 0.0), (-0.1, 0.4, 0.0))
        twin = Triangle(albedo=colour, to_world=shape.to_world, vertices=corners, two_sided=shape.two_sided)
    elif isinstance(shape, Cube) and draft.draws.chance(0.5):
        lid = compose(shape.to_world, translation(0, 0, 0.5))
        twin = Square(albedo=colour, to_world=lid, two_sided=draft.draws.chance(0.5))
    else:
        twin = replace(shape, albedo=colour)
    draft.shapes.insert(draft.draws.whole(0, len(draft.shapes)), twin)


@FEATURES.register("touching_shapes", step=Step.PLACES, what="Two shapes touch in a point, an edge or a face.")
def touching_shapes(draft: Draft) -> None:
    """Put a sphere or a cube beside a cube or onto a square, so that they just meet."""
    index = draft.any_of(Cube, Square, Plane)
    host = draft.shapes[index].to_world
    height = 0.5 if isinstance(draft.shapes[index], Cube) else 0.0
    colour = rgb(draft.draws, 0.2, 0.9)
    if draft.draws.chance(0.5):
        guest = Sphere(albedo=colour, radius=0.25, to_world=compose(host, translation(0.1, 0.05, height + 0.25)))
    else:
        aside = draft.draws.choice((0.0, 0.25, 1.0))
        guest = Cube(albedo=colour, to_world=compose(host, translation(aside, 0, height + 0.5)))
    draft.shapes.append(guest)


def _placed(draft: Draft) -> int:
    """Return the index of a shape that a matrix may deform."""
    return draft.any_of(Sphere, Cube, Square, Triangle, Mesh)


@FEATURES.register("mirrored", step=Step.SHAPES, what="A shape's matrix mirrors.")
def mirrored(draft: Draft) -> None:
    """Mirror a shape along one of its axes."""
    index = _placed(draft)
    factors = [1.0, 1.0, 1.0]
    factors[draft.draws.whole(0, 2)] = -1.0
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, scaling(*factors)))


@FEATURES.register("sheared", step=Step.SHAPES, what="A shape's matrix shears and stretches.")
def sheared(draft: Draft) -> None:
    """Shear a shape and stretch it unevenly."""
    index, draws = _placed(draft), draft.draws
    slant = shear(xy=draws.uniform(-1, 1), xz=draws.uniform(-1, 1), yz=draws.uniform(-1, 1))
    stretch = scaling(draws.uniform(0.5, 1.5), draws.uniform(0.5, 1.5), draws.uniform(0.5, 1.5))
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, slant, stretch))


@FEATURES.register("ill_conditioned", step=Step.SHAPES, what="A shape's matrix has a condition number near 1000.")
def ill_conditioned(draft: Draft) -> None:
    """Squeeze a shape along a skew axis by 300 to 1000."""
    index, draws = _placed(draft), draft.draws
    turn, ratio = rotation(draws.direction(), draws.uniform(0, 180)), draws.logarithmic(300, 1000)
    size = ratio ** draws.uniform(0, 0.5)
    squeeze = scaling(size, size ** draws.uniform(0, 1), size / ratio)
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, squeeze, turn))


@FEATURES.register("plane_alone", step=Step.SHAPES, group="shapes", what="There is nothing but an infinite plane.")
def plane_alone(draft: Draft) -> None:
    """Leave one plane that the camera looks down on."""
    draft.shapes[:] = [shape_of(Plane, draft.draws, translation(0, 0, -0.5))]
    draft.target = draft.draws.vector(-0.5, 0.5)


@FEATURES.register("crowded", step=Step.SHAPES, group="shapes", what="There are twelve to twenty shapes of one kind.")
def crowded(draft: Draft) -> None:
    """Add so many shapes of a kind that renderers put them into a hierarchy."""
    kind = draft.draws.choice((Sphere, Cube, Square, Triangle))
    for _ in range(draft.draws.whole(12, 20)):
        draft.shapes.append(shape_of(kind, draft.draws, compose(placement(draft.draws), scaling(0.4, 0.4, 0.4))))


@FEATURES.register("two_sided", step=Step.SHAPES, what="Every shape is two-sided.")
def two_sided(draft: Draft) -> None:
    """Make every shape two-sided."""
    draft.shapes[:] = [replace(shape, two_sided=True) for shape in draft.shapes]


@FEATURES.register("empty", step=Step.SHAPES, group="shapes", bare=True, what="There is no shape.")
def empty(draft: Draft) -> None:
    """Remove every shape."""
    draft.shapes.clear()


@FEATURES.register("albedo_extremes", step=Step.SHAPES, what="Albedos are 0, or 1e12 apart between channels.")
def albedo_extremes(draft: Draft) -> None:
    """Give some shapes albedos from 0 to 1e6."""
    options = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.5), (1e-6, 1.0, 1e6), (1.0, 1e-12, 0.3))
    draft.shapes[:] = [
        replace(shape, albedo=draft.draws.choice(options)) if index == 0 or draft.draws.chance(0.5) else shape
        for index, shape in enumerate(draft.shapes)
    ]
