"""A world four times as large and sixteen times as bright is the same, nearly to the last bit."""

from collections.abc import Iterator

from rayproof.cases.changes import carried_by, moved
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import scaling
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

FACTOR = 4.0


@LAWS.register("scale_power", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2", "LIT-3", "LIT-5", "HIT-1"))
def scale_power(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Scale all lengths by 4 and flux by 16: no digit changes, as far as formulas divide and multiply.

    Proof: floating point has the same digits around 4 x as around x, and 1 / (16 r^2) and 16 Phi cancel. Not to the
    last bit: a renderer may take a shape's normal as it is where the matrix is the identity, and normalise it once more
    where it is not; some u of the normal are then some of the light. Source: IEEE 754-2019, section 4.3.
    """
    motion = scaling(FACTOR, FACTOR, FACTOR)
    changed, before = moved(scene, motion, scale=FACTOR), carried_by(motion, scale=FACTOR)
    conditions = Conditions(factor=0.25)
    yield from related(
        ask, scene, changed, what="all lengths times 4, flux times 16", before=before, conditions=conditions
    )
