"""A world three times as large, nine times as bright, looks the same."""

from collections.abc import Iterator

from rayproof.cases.changes import carried_by, has_triangles, moved
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import scaling
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

FACTORS = (3.0, 0.01)


@LAWS.register("scale", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2", "XF-1", "LIT-3", "LIT-5", "HIT-6"))
def scale(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Scale all lengths by s and flux by s^2: lengths scale, radiance stays. No length of its own may be in a formula.

    Proof: E = Phi cos / (4 pi r^2), with Phi and r^2 both times s^2; everything else is angles and ratios of lengths.
    Source: Buckingham, On Physically Similar Systems (1914); specification, RAD-1.
    """
    conditions = Conditions(rebaked=has_triangles(scene))
    for factor in FACTORS:
        motion = scaling(factor, factor, factor)
        before = carried_by(motion, scale=factor)
        changed = moved(scene, motion, scale=factor)
        what = f"all lengths times {factor:g}, flux times {factor * factor:g}"
        yield from related(ask, scene, changed, what=what, before=before, conditions=conditions)
