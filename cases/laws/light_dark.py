"""A light without flux gives no light."""

from collections.abc import Iterator

from rayproof.cases.changes import vector, view, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage


@LAWS.register("light_dark", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5"))
def light_dark(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put lights of 0 W before, among and after the others: nothing changes, to the last bit.

    Proof: each adds Phi cos / (4 pi r^2) = 0, and x + 0 = x also when rounded. Source: specification, RAD-5.
    """
    if scene.lights:
        axes = view(scene.camera)
        places = [axes.eye + axes.distance * (share * axes.right + 0.4 * axes.up) for share in (-0.5, 0.2, 0.6)]
        before, among, after = (PointLight(position=vector(place), flux=(0.0, 0.0, 0.0)) for place in places)
        first, *others = scene.lights
        changed = with_lights(scene, before, first, among, *others, after)
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="three lights of 0 W", stages=LIGHT, conditions=conditions)
