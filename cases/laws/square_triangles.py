"""A square is two triangles."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import coincide, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape, Square
from rayproof.cases.stages import Stage

CORNERS = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0))


def halves(shape: Shape) -> Shape:
    """Return a square as two triangles."""
    if not isinstance(shape, Square):
        return shape
    return Mesh(
        albedo=shape.albedo,
        to_world=shape.to_world,
        two_sided=shape.two_sided,
        vertices=np.array(CORNERS),
        faces=np.array([(0, 1, 2), (0, 2, 3)]),
    )


@LAWS.register("square_triangles", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-7", "HIT-8", "NRM-3"))
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
