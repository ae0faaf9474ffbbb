"""Light scales with a power of two to the last bit."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import times, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

FACTOR = 2.0**12  # bright enough for any value to pass 1, where displays clamp


@LAWS.register("flux_power", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-3", "RAD-4", "RAD-5"))
def flux_power(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every flux by 2^12: irradiance, exitance and radiance are 2^12 times as large, to the last bit.

    Proof: each is a product with Phi or a sum of such, and rounding commutes with powers of two as long as nothing
    overflows or vanishes. Source: IEEE 754-2019, section 4.3; specification, RAD-1.
    """
    if scene.lights:
        changed = with_lights(scene, *(replace(light, flux=times(light.flux, FACTOR)) for light in scene.lights))
        before = {stage: lambda image: image * FACTOR for stage in LIGHT}
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="flux times 2^12", before=before, conditions=conditions)
