"""A primitive turned by its own symmetry is itself."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import matrix, placed, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Cube, Plane, Scene, Shape, Sphere, Square
from rayproof.cases.stages import Stage

# Whole numbers: corners go to corners exactly.
CYCLE = ((0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
QUARTER = matrix(np.round(np.asarray(rotation((0, 0, 1), 90))))


def turned(shape: Shape) -> Shape:
    """Return a shape after a motion of its object space that carries it onto itself."""
    if isinstance(shape, Sphere):
        away = translation(*(-x for x in shape.center))
        return placed(shape, compose(translation(*shape.center), rotation((0.2, 0.9, -0.4), 50), away))
    if isinstance(shape, Cube):
        return placed(shape, compose(CYCLE, scaling(-1, 1, 1)))
    if isinstance(shape, Square):
        return placed(shape, QUARTER)
    if isinstance(shape, Plane):
        return placed(shape, compose(translation(0.3, -0.2, 0), rotation((0, 0, 1), 40), scaling(2, 3, 1)))
    return shape


@LAWS.register(
    "symmetry", stage=Stage.NORMAL, implicates=("XF-1", "XF-2", "HIT-1", "HIT-3", "HIT-4", "HIT-7", "NRM-2", "NRM-3")
)
def symmetry(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn spheres about their centres, cubes onto their faces, squares by a quarter, planes in themselves: all stays.

    Proof: each motion carries the primitive, and which side is out, onto itself. Source: Weyl, Symmetry (1952).
    """
    changed = with_shapes(scene, turned)
    if changed != scene:
        yield from related(ask, scene, changed, what="every primitive turned by its own symmetry")
