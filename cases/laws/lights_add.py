"""The image by all lights is the sum of the images by each."""

from collections.abc import Iterator

from rayproof.cases.changes import at_least_two, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, added
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("lights_add", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5"))
def lights_add(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch the lights on one by one: what each gives adds up, and nothing is clamped, averaged or left out.

    Proof: E is a sum over lights; whether one is seen does not depend on another.
    Source: Kajiya, The Rendering Equation (1986); specification, LIT-1 and RAD-5.
    """
    if scene.lights:
        whole = at_least_two(scene)
        parts = tuple(with_lights(whole, light) for light in whole.lights)
        yield from added(ask, parts, whole, what=f"{len(parts)} lights one by one")
