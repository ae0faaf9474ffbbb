"""Renaming the axes x -> y -> z -> x changes no number, only its place."""

from collections.abc import Iterator

from rayproof.cases.changes import carried_by, has_triangles, moved
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

TURN = ((0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@LAWS.register("axes", stage=Stage.OBJECT, implicates=("XF-1", "HIT-3", "NRM-2", "NRM-3"))
def axes(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn everything by a third about the diagonal (1, 1, 1): no axis of the world is special.

    Proof: a permutation of coordinates is a rigid motion whose matrix holds zeros and ones, so that coordinates only
    change places. Source: Weyl, Symmetry (1952); specification, conventions.
    """
    conditions = Conditions(rebaked=has_triangles(scene))
    changed = moved(scene, TURN)
    yield from related(
        ask, scene, changed, what="x, y, z renamed y, z, x", before=carried_by(TURN), conditions=conditions
    )
