"""Radiance is invariant along a ray: a camera that moves along its central ray sees the same value there.

Rays do not interact and lights add, so the value is the sum of two closed forms at every distance of the camera
(Nicodemus, Radiance, American Journal of Physics 31 (1963), 368).
"""

from collections.abc import Iterator
from math import pi

import numpy as np

from rayproof.cases.case import Case, PixelValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import PointLight, Scene, Sphere, Square, Vector
from rayproof.cases.stages import Stage

CENTER: Vector = (0.2, 0.3, -0.1)
TILT = compose(translation(*CENTER), rotation((0.7, -0.5, 0.4), 23))
SQUARE = Square(albedo=(0.75, 0.45, 0.3), to_world=compose(TILT, scaling(4.0, 3.5, 1.0)))
SPHERE = Sphere(albedo=(0.3, 0.7, 0.5), center=mapped(TILT, (1.1, 0.6, 0.6)), radius=0.5)
LIGHTS = (
    PointLight(position=mapped(TILT, (-1.2, 0.8, 2.0)), flux=(300.0, 120.0, 200.0)),
    PointLight(position=mapped(TILT, (1.5, -1.0, 2.6)), flux=(90.0, 350.0, 260.0)),
)
DISTANCES = ((1.5, 3000), (3.0, 3000), (6.0, 2200), (12.0, 450))  # m, and least interior pixels
WIDTH, HEIGHT = 73, 57  # odd: a pixel centre lies on the central ray
ROUNDINGS = 30  # of the feelers and their lengths (10), cosines and falloffs (15), sum and radiance (5)
PLACE = 10  # roundings of the camera's distance: how far the hit may lie from its place


def irradiance(channel: int) -> float:
    """Return E [W/m^2] at the square's centre, summed over the lights."""
    normal = np.subtract(mapped(TILT, (0.0, 0.0, 1.0)), CENTER)
    total = 0.0
    for light in LIGHTS:
        toward = np.subtract(light.position, CENTER)
        squared = float(toward @ toward)
        total += light.flux[channel] * float(normal @ toward) / (4 * pi * squared**1.5)
    return total


@CASE_FAMILIES.register("invariance")
def invariance() -> Iterator[Case]:
    """Yield one case per distance of the camera; the expectation is the same in all of them."""
    for distance, least_interior in DISTANCES:
        camera = camera_around(
            CENTER, distance=distance, azimuth=-95, elevation=54, width=WIDTH, height=HEIGHT, fovy=34, roll=17
        )
        scene = Scene(camera=camera, shapes=(SQUARE, SPHERE), lights=LIGHTS)
        # A hit that is misplaced by s changes Phi cos / r^2 by (2 + tan) s / r; here tan < 1 and r > 2 m.
        roundings = ROUNDINGS + PLACE * 3 * distance / 2
        yield Case(
            name=f"invariance/from_{distance:g}m",
            scene=scene,
            stresses=f"A camera {distance:g} m away on one ray: the central radiance is that of every other distance.",
            covers=covering(scene, "CAM-5", "LIT-2", "LIT-3", "LIT-4", "RAD-5"),
            least_interior=least_interior,
            most_edge=0.04,
            expectations=tuple(
                PixelValue(
                    stage=Stage.RADIANCE,
                    column=WIDTH // 2,
                    row=HEIGHT // 2,
                    channel=channel,
                    value=SQUARE.albedo[channel] / pi * irradiance(channel),
                    relative=gamma(roundings, precision="float32"),
                    because=f"rho / pi times the sum of Phi cos / (4 pi r^2), without the camera's distance; float32: "
                    f"{ROUNDINGS} roundings, and a hit misplaced by {PLACE} roundings of {distance:g} m",
                )
                for channel in range(3)
            ),
        )
