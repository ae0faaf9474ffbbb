"""A light in the middle of a sphere lights it evenly."""

from collections.abc import Iterator
from math import pi

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Relation
from rayproof.cases.scene import Camera, PointLight, Scene, Sphere
from rayproof.cases.stages import Stage

RADIUS, ALBEDO, FLUX = 2.5, (0.25, 0.5, 0.75), (300.0, 500.0, 700.0)  # m, 1, W


@LAWS.register(
    "anchor_sphere", stage=Stage.RADIANCE, implicates=("RAD-1", "RAD-4", "HIT-1", "NRM-1"), anchor=True, own=True
)
def anchor_sphere(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look about inside a two-sided sphere with a light in its middle: L = albedo Phi / (4 pi^2 R^2) everywhere.

    Proof: every point of the wall is R away from the light and faces it. Source: Ulbricht, Die Bestimmung der mittleren
    räumlichen Lichtintensität (1900), without interreflection; specification, RAD-4.
    """
    del scene
    camera = Camera(
        eye=(0.4, -0.3, 0.5), target=(2.0, 1.0, -1.0), up=(0.0, 0.0, 1.0), fovy=70.0, width=15, height=11, near=0.01,
        far=100.0,
    )  # fmt: skip
    sphere = Sphere(albedo=ALBEDO, radius=RADIUS, two_sided=True)
    world = Scene(camera=camera, shapes=(sphere,), lights=(PointLight(position=(0.0, 0.0, 0.0), flux=FLUX),))
    irradiance = np.asarray(FLUX) / (4 * pi * RADIUS**2)
    exitance = irradiance * ALBEDO
    values = {Stage.IRRADIANCE: irradiance, Stage.EXITANCE: exitance, Stage.RADIANCE: exitance / pi}
    answers = ask(world)
    for stage in LIGHT:
        if stage in answers:
            yield Relation(
                stage=stage,
                expected=np.broadcast_to(values[stage], answers[stage].shape),
                measured=answers[stage],
                scene=world,
                changed=world,
                what="a light in the middle of a sphere",
            )
