"""A light in a closed box gives no light outside of it."""

from collections.abc import Iterator

from rayproof.cases.changes import around, behind_the_eye, switched_on, view
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import Cube, Scene, Sphere
from rayproof.cases.stages import Stage


@LAWS.register("light_hidden", stage=Stage.VISIBILITY, implicates=("LIT-1", "HIT-1", "HIT-3", "HIT-9"))
def light_hidden(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch on a light in a small closed cube, and in a sphere, behind the eye: nothing changes.

    Proof: every segment that leads to the light crosses a wall. Walls are there in both images, so that what else they
    hide cancels. Source: specification, LIT-1 and E10.
    """
    place = behind_the_eye(scene, 0.25)
    for kind in (Cube, Sphere):
        wall = around(scene, place, 0.02 * view(scene.camera).distance, kind)
        dark, lit = switched_on(scene, place, wall)
        what = f"a light switched on inside a closed {kind.__name__.lower()}"
        yield from related(ask, dark, lit, what=what, stages=LIGHT, conditions=Conditions(exact=True))
