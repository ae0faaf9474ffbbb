"""Triangles may be moved by their matrix or stand where it takes them."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import moved_triangles, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import world_triangles
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import IDENTITY, Mesh, Scene, Shape, Triangle
from rayproof.cases.stages import Stage


def standing(shape: Shape) -> Shape:
    """Return triangles and meshes as meshes that need no matrix."""
    if not isinstance(shape, Triangle | Mesh):
        return shape
    corners = world_triangles(shape)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Mesh(
        albedo=shape.albedo,
        to_world=IDENTITY,
        two_sided=shape.two_sided,
        vertices=corners.reshape(-1, 3),
        faces=faces,
    )


@LAWS.register("baked", stage=Stage.NORMAL, implicates=("XF-1", "NRM-3", "HIT-6"))
def baked(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Bake every triangle's corners into the world: nothing changes, the corners are the same float32 numbers.

    Proof: the scene bakes them once in float64 and rounds once to float32, for every renderer; a normal that is the
    inverse transpose of the object's is that of the baked corners, but for what rounding turns them.
    Source: specification, conventions.
    """
    if moved_triangles(scene):
        conditions = Conditions(rebaked=True)
        changed = with_shapes(scene, standing)
        yield from related(ask, scene, changed, what="triangles baked into the world", conditions=conditions)
