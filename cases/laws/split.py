"""A triangle is its four quarters."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import has_triangles, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape, Triangle
from rayproof.cases.stages import Stage

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
    return Mesh(
        albedo=shape.albedo,
        to_world=shape.to_world,
        two_sided=shape.two_sided,
        vertices=vertices,
        faces=np.arange(len(vertices)).reshape(-1, 3),
    )


@LAWS.register("split", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-9"))
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
