"""A mesh is two meshes, each with half of its faces."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape
from rayproof.cases.stages import Stage


@LAWS.register("mesh_parts", stage=Stage.OBJECT, implicates=("HIT-6", "HIT-9", "LIT-1"))
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
