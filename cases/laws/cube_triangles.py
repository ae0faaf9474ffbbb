"""A cube is twelve triangles."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import coincide, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Cube, Mesh, Scene, Shape
from rayproof.cases.stages import Stage

CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # seen from outside
FACES = np.array([half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))])


def twelve(shape: Shape) -> Shape:
    """Return a cube as a mesh."""
    if not isinstance(shape, Cube):
        return shape
    return Mesh(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided, vertices=CORNERS, faces=FACES)


@LAWS.register("cube_triangles", stage=Stage.OBJECT, implicates=("HIT-3", "HIT-5", "HIT-6", "NRM-2"))
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
