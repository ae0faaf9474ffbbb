"""A triangle is a mesh of one face."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape, Triangle
from rayproof.cases.stages import Stage


def as_mesh(shape: Shape) -> Shape:
    """Return a triangle as a mesh."""
    if not isinstance(shape, Triangle):
        return shape
    return Mesh(
        albedo=shape.albedo,
        to_world=shape.to_world,
        two_sided=shape.two_sided,
        vertices=np.array(shape.vertices),
        faces=np.array([(0, 1, 2)]),
    )


@LAWS.register("triangle_mesh", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6"))
def triangle_mesh(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Hand every triangle over as a mesh of one face: nothing changes.

    Proof: both are three float32 corners, baked alike. Source: specification, conventions.
    """
    if any(isinstance(shape, Triangle) for shape in scene.shapes):
        yield from related(ask, scene, with_shapes(scene, as_mesh), what="every triangle handed over as a mesh")
