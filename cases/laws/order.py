"""Laws of order: shapes, faces, corners and lights reordered, triangles rewound, two sides, squares turned over."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws.relations import (
    GEOMETRY,
    Ask,
    Relation,
    added,
    at_least_two,
    coincide,
    has_triangles,
    placed,
    related,
    rewound,
    with_lights,
    with_shapes,
)
from rayproof.cases.placement import scaling
from rayproof.cases.scene import Mesh, Plane, Scene, Shape, Square, Triangle
from rayproof.cases.stages import Stage


# Shapes may come in any order.
def shapes_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List the shapes backwards: object indices come backwards, and nothing else changes.

    Proof: the nearest hit is the least of a set, and so is whether any shape blocks a feeler. Where two shapes' sides
    lie in one plane there is no nearest, and the law says nothing. Source: specification, HIT-9.
    """
    count = len(scene.shapes)
    if count < 2 or coincide(scene):
        return

    def renamed(image: np.ndarray) -> np.ndarray:
        return np.stack([np.where(image[..., 0] >= 0, count - 1 - image[..., 0], -1.0), image[..., 1]], axis=-1)

    changed = replace(scene, shapes=scene.shapes[::-1])
    yield from related(ask, scene, changed, what="the shapes listed backwards", before={Stage.OBJECT: renamed})


# What is seen of many shapes is what is seen of the nearest of them alone.
MOST = 12  # shapes


def shapes_alone(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Take all shapes but one away, each in turn: every pixel sees the one that it sees nearest alone.

    Proof: the nearest hit over all geometry is the least of each shape's nearest. Source: specification, HIT-9.
    """
    count = len(scene.shapes)
    if not 2 <= count <= MOST:
        return
    whole = ask(scene)
    if not all(stage in whole for stage in (Stage.OBJECT, Stage.DISTANCE)):
        return
    parts = [replace(scene, shapes=(shape,)) for shape in scene.shapes]
    alone = [ask(part) for part in parts]
    distances = np.stack([answers[Stage.DISTANCE][..., 0] for answers in alone])
    nearest = np.argmin(distances, axis=0)
    for stage in GEOMETRY[1:]:
        if stage in whole and all(stage in answers for answers in alone):
            images = np.stack([answers[stage] for answers in alone])
            if stage is Stage.OBJECT:
                numbers = np.arange(count)[:, np.newaxis, np.newaxis]
                images[..., 0] = np.where(images[..., 0] >= 0, numbers, -1)
            expected = np.take_along_axis(images, nearest[np.newaxis, ..., np.newaxis], axis=0)[0]
            yield Relation(
                stage=stage,
                expected=expected,
                measured=whole[stage],
                scene=parts[0],
                changed=scene,
                what="each shape alone",
            )


# A mesh's faces may come in any order, and begin at any corner.
def reordered(shape: Shape) -> Shape:
    """Return a mesh with its faces backwards and each begun at its second corner; a triangle begun there."""
    if isinstance(shape, Mesh):
        return replace(shape, faces=np.roll(shape.faces[::-1], 1, axis=1))
    if isinstance(shape, Triangle):
        a, b, c = shape.vertices
        return replace(shape, vertices=(c, a, b))
    return shape


def faces_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List every mesh's faces backwards, each from another corner: face indices come backwards, all else stays.

    Proof: the nearest hit is the least of a set, and a cyclic change of corners keeps a triangle and its winding.
    Source: specification, HIT-5 and HIT-9.
    """
    counts = np.array([len(shape.faces) if isinstance(shape, Mesh) else 0 for shape in scene.shapes] + [0])
    changed = with_shapes(scene, reordered)
    if changed == scene:
        return

    def renamed(image: np.ndarray) -> np.ndarray:
        faces = counts[image[..., 0].astype(int)]
        return np.stack([image[..., 0], np.where(faces > 0, faces - 1 - image[..., 1], image[..., 1])], axis=-1)

    yield from related(ask, scene, changed, what="every mesh's faces backwards", before={Stage.OBJECT: renamed})


# Of a two-sided triangle it does not matter which way it is wound.
def two_sided(shape: Shape) -> Shape:
    """Return triangles and meshes with two sides."""
    return replace(shape, two_sided=True) if isinstance(shape, Triangle | Mesh) else shape


def winding(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Wind every triangle, all of them two-sided, the other way: nothing changes.

    Proof: nothing is culled, and a two-sided surface's normal is turned towards the viewer whichever way it pointed.
    Source: specification, `two_sided` and E12.
    """
    if has_triangles(scene):
        first = with_shapes(scene, two_sided)
        yield from related(ask, first, with_shapes(first, rewound), what="two-sided triangles wound the other way")


# What a two-sided surface shows is what its front and its back show.
HALF_TURN = scaling(1, -1, -1)  # half a turn about x


def flat(shape: Shape) -> bool:
    """Say whether a shape can be turned over where it lies."""
    return isinstance(shape, Square | Plane | Triangle | Mesh)


def turned_over(shape: Shape) -> Shape:
    """Return a flat shape with its back to the front."""
    return placed(shape, HALF_TURN) if isinstance(shape, Square | Plane) else rewound(shape)


def sides_add(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Add the image of all flat shapes' fronts to that of their backs: it is the image of both sides.

    Proof: whoever sees one side does not see the other, of which the radiance is 0; what blocks light is the same.
    Round shapes are black in all three. Source: specification, `two_sided` and E12.
    """
    if not any(flat(shape) for shape in scene.shapes) or not scene.lights:
        return

    def prepared(shape: Shape) -> Shape:
        one_sided = replace(shape, two_sided=False)
        return one_sided if flat(shape) else replace(one_sided, albedo=(0.0, 0.0, 0.0))

    front = with_shapes(scene, prepared)
    back = with_shapes(front, lambda shape: turned_over(shape) if flat(shape) else shape)
    both = with_shapes(front, lambda shape: replace(shape, two_sided=flat(shape)))
    for relation in added(ask, (front, back), both, what="fronts and backs of flat shapes"):
        if relation.stage is Stage.RADIANCE:  # irradiance does not depend on who looks at which side
            yield relation


# Lights may come in any order.
def lights_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List the lights backwards: visibility comes backwards, and the light stays.

    Proof: E is a sum over lights, and sums commute up to rounding. Source: specification, LIT-1 and RAD-5.
    """
    if scene.lights:
        first = at_least_two(scene)
        changed = with_lights(first, *first.lights[::-1])
        before = {Stage.VISIBILITY: lambda image: np.flip(image, axis=-1)}
        yield from related(ask, first, changed, what="the lights listed backwards", before=before)
