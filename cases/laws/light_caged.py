"""A wall at nine tenths of the way to a light hides it as well as one that is near."""

from collections.abc import Iterator

from rayproof.cases.changes import around, behind_the_eye, switched_on, view
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage


@LAWS.register("light_caged", stage=Stage.VISIBILITY, implicates=("LIT-1", "LIT-3", "LIT-5"))
def light_caged(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch on a light in the middle of a sphere that begins at 0.9 and at 0.995 of the way: nothing changes.

    Proof: the segment from any point outside of the sphere to its centre crosses it, and feelers that end early do not
    notice. Source: specification, LIT-1.
    """
    for share in (0.9, 0.995):
        place = behind_the_eye(scene, 0.25)
        radius = (1 - share) * 1.25 * view(scene.camera).distance
        dark, lit = switched_on(scene, place, around(scene, place, radius, Sphere))
        what = f"a light switched on in a sphere that begins at {share:g} of the way"
        yield from related(ask, dark, lit, what=what, stages=LIGHT, conditions=Conditions(exact=True))
