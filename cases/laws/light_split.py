"""A light is eight lights of an eighth each in its place."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import times, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

SHARES = (0.02, 0.08, 0.05, 0.2, 0.15, 0.1, 0.25, 0.15)  # in sum 1, and no two neighbours alike


@LAWS.register("light_split", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5"))
def light_split(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put eight lights that share its flux in the first light's place: the light stays.

    Proof: E is a sum over lights, and the eight have all but the flux in common, which adds up.
    Source: Kajiya, The Rendering Equation (1986); specification, RAD-5.
    """
    if scene.lights:
        first, *others = scene.lights
        parts = (replace(first, flux=times(first.flux, share)) for share in SHARES)
        changed = with_lights(scene, *others, *parts)
        yield from related(ask, scene, changed, what="the first light split into eight", stages=LIGHT)
