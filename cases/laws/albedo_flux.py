"""What albedo gains and flux loses by a power of two, radiance does not notice, to the last bit."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import times, with_lights, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("albedo_flux", stage=Stage.EXITANCE, implicates=("RAD-1", "RAD-3", "RAD-4"))
def albedo_flux(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Halve every albedo and double every flux: irradiance doubles, exitance and radiance stay, to the last bit.

    Proof: M = albedo E is linear in either, and a product with a power of two is not rounded.
    Source: specification, RAD-4; IEEE 754-2019, section 4.3.
    """
    if scene.lights:
        darker = with_shapes(scene, lambda shape: replace(shape, albedo=times(shape.albedo, 0.5)))
        lights = (replace(light, flux=times(light.flux, 2.0)) for light in scene.lights)
        changed = with_lights(darker, *lights)
        before = {Stage.IRRADIANCE: lambda image: image * 2.0}
        conditions = Conditions(exact=True)
        yield from related(
            ask, scene, changed, what="albedo halved, flux doubled", before=before, conditions=conditions
        )
