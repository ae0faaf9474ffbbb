"""Red, green and blue are three numbers that nothing mixes and nothing prefers."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import with_lights, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import Rgb, Scene
from rayproof.cases.stages import Stage


def turned(colour: Rgb) -> Rgb:
    """Return a colour with its channels moved on by one."""
    red, green, blue = colour
    return blue, red, green


@LAWS.register("channels", stage=Stage.EXITANCE, implicates=("RAD-1", "RAD-3", "RAD-4"))
def channels(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move the channels of every flux and albedo on by one: those of the image move on by one, to the last bit.

    Proof: the specification's formulas are the same for each channel, and none has two channels in it.
    Source: specification, RAD-1 to RAD-4.
    """
    if scene.lights:
        painted = with_shapes(scene, lambda shape: replace(shape, albedo=turned(shape.albedo)))
        changed = with_lights(painted, *(replace(light, flux=turned(light.flux)) for light in scene.lights))
        before = {stage: lambda image: image[..., [2, 0, 1]] for stage in LIGHT}
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="channels moved on by one", before=before, conditions=conditions)
