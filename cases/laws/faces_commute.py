"""A mesh's faces may come in any order, and begin at any corner."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape, Triangle
from rayproof.cases.stages import Stage


def reordered(shape: Shape) -> Shape:
    """Return a mesh with its faces backwards and each begun at its second corner; a triangle begun there."""
    if isinstance(shape, Mesh):
        return replace(shape, faces=np.roll(shape.faces[::-1], 1, axis=1))
    if isinstance(shape, Triangle):
        a, b, c = shape.vertices
        return replace(shape, vertices=(c, a, b))
    return shape


@LAWS.register("faces_commute", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-9"))
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
