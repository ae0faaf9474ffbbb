"""A light above a floor: the inverse square and the cosine, in every pixel."""

from collections.abc import Iterator
from dataclasses import replace
from math import pi

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Relation
from rayproof.cases.scene import Camera, PointLight, Scene, Square
from rayproof.cases.stages import Stage

HEIGHT, ASIDE, ALBEDO, FLUX = 1.25, (0.4, -0.3), (0.25, 0.5, 0.75), (300.0, 500.0, 700.0)  # m, m, 1, W
CAMERA = Camera(
    eye=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=50.0, width=23, height=15, near=0.1, far=10.0
)


@LAWS.register(
    "anchor_floor",
    stage=Stage.IRRADIANCE,
    implicates=("CAM-3", "CAM-4", "RAD-1", "RAD-2", "RAD-3", "RAD-4"),
    anchor=True,
    own=True,
)
def anchor_floor(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look straight down at a floor under a light: E = Phi h / (4 pi (h^2 + a^2)^1.5), a from the light's foot.

    Proof: cos = h / r and r^2 = h^2 + a^2; pixel (c, r) sees x = D tan(alpha) aspect sx, y = D tan(alpha) sy. In the
    lecture's simplified model E = Phi h / r. Source: CIE 171:2006, test case 5.2; specification, RAD-1 to RAD-4.
    """
    del scene
    floor = Square(albedo=ALBEDO, to_world=((9.0, 0, 0, 0), (0, 9.0, 0, 0), (0, 0, 1.0, 0), (0, 0, 0, 1.0)))
    light = PointLight(position=(*ASIDE, HEIGHT), flux=FLUX)
    world = Scene(camera=CAMERA, shapes=(floor,), lights=(light,))
    tall = CAMERA.eye[2] * np.tan(CAMERA.alpha)
    across = (2 * (np.arange(CAMERA.width) + 0.5) / CAMERA.width - 1) * tall * CAMERA.aspect
    up = (1 - 2 * (np.arange(CAMERA.height) + 0.5) / CAMERA.height) * tall
    x, y = np.meshgrid(across, up)
    r = np.sqrt((x - ASIDE[0]) ** 2 + (y - ASIDE[1]) ** 2 + HEIGHT**2)
    for shading in ("inverse_square", "simplified"):
        physical = shading == "inverse_square"
        spread = HEIGHT / (4 * pi * r**3) if physical else HEIGHT / r
        irradiance = np.asarray(FLUX) * spread[..., np.newaxis]
        exitance = irradiance * ALBEDO
        values = {
            Stage.IRRADIANCE: irradiance,
            Stage.EXITANCE: exitance,
            Stage.RADIANCE: exitance / pi if physical else exitance,
        }
        lit = replace(world, shading=shading)
        answers = ask(lit)
        for stage in LIGHT:
            if stage in answers:
                yield Relation(
                    stage=stage,
                    expected=values[stage],
                    measured=answers[stage],
                    scene=lit,
                    changed=lit,
                    what=f"a floor under a light ({shading})",
                )
