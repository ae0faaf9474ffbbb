"""A point light over a square at known distances and angles: the inverse-square law and Lambert's cosine law.

The centre of the image sees the centre of the square, so E = Phi cos / (4 pi r^2) is known there in closed form
(Lambert, Photometria, 1760; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed. (2023), section 4.1).
"""

from collections.abc import Iterator
from math import cos, pi, radians, sin, tan

from rayproof.cases.case import Case, PixelValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import PointLight, Scene, Square, Vector
from rayproof.cases.stages import Stage

CENTER: Vector = (0.4, -0.3, 0.6)
TILT = compose(translation(*CENTER), rotation((1.0, 0.5, 0.3), 28))
SQUARE = Square(albedo=(0.7, 0.5, 0.25), to_world=compose(TILT, scaling(3.0, 2.2, 1.0)))
FLUX = (400.0, 250.0, 520.0)  # W
DISTANCES = (0.5, 1.0, 2.0, 4.0, 8.0)  # m; straight above, each step a quarter of the irradiance
ANGLES = (30.0, 60.0, 75.0, 85.0, 95.0, 150.0)  # degrees from the normal, at 2 m; the last two below the horizon
WIDTH, HEIGHT = 81, 65  # odd: a pixel centre lies on the central ray
EYE_DISTANCE = 5.0  # m
ROUNDINGS = 25  # of the feeler vector and its length (10), cosine and falloff (15)
PLACE = 10  # roundings of the eye's distance: how far the hit may lie from its place


def lit(name: str, stresses: str, distance: float, angle: float, least_interior: int) -> Case:
    """Return the case of a light at `distance` [m] from the square's centre, `angle` degrees off its normal."""
    turn = radians(angle)
    light = mapped(TILT, (distance * sin(turn) * 0.8, distance * sin(turn) * 0.6, distance * cos(turn)))
    camera = camera_around(
        CENTER, distance=EYE_DISTANCE, azimuth=-70, elevation=48, width=WIDTH, height=HEIGHT, fovy=38
    )
    scene = Scene(camera=camera, shapes=(SQUARE,), lights=(PointLight(position=light, flux=FLUX),))
    above = angle < 90
    falloff = cos(turn) / (4 * pi * distance**2) if above else 0.0
    # A hit that is misplaced by s changes 1 / r^2 by 2 s / r and the cosine by tan s / r.
    roundings = ROUNDINGS + PLACE * (2 + abs(tan(turn))) * EYE_DISTANCE / distance
    because = (
        f"Phi cos / (4 pi r^2); float32: {ROUNDINGS} roundings, and a hit misplaced by {PLACE} roundings of "
        f"{EYE_DISTANCE:g} m counts (2 + tan) / r"
        if above
        else "below the horizon nothing arrives, exactly"
    )
    return Case(
        name=f"inverse_square/{name}",
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=least_interior,
        most_edge=0.03,
        expectations=tuple(
            PixelValue(
                stage=stage,
                column=WIDTH // 2,
                row=HEIGHT // 2,
                channel=channel,
                value=flux * falloff * factor[channel],
                relative=gamma(roundings, precision="float32") if above else 0.0,
                because=because,
            )
            for stage, factor in (
                (Stage.IRRADIANCE, (1.0, 1.0, 1.0)),
                (Stage.EXITANCE, SQUARE.albedo),
                (Stage.RADIANCE, tuple(albedo / pi for albedo in SQUARE.albedo)),
            )
            for channel, flux in enumerate(FLUX)
        ),
    )


@CASE_FAMILIES.register("inverse_square")
def inverse_square() -> Iterator[Case]:
    """Yield the sweep over distance, then the sweep over angle."""
    for distance in DISTANCES:
        yield lit(
            f"distance_{distance:g}m",
            f"A light {distance:g} m straight above a square: irradiance falls with the square of the distance.",
            distance,
            0.0,
            1200,
        )
    for angle in ANGLES:
        place = "above" if angle < 90 else "below"
        yield lit(
            f"angle_{angle:g}",
            f"A light {angle:g} degrees off the normal, {place} the horizon: Lambert's cosine and its clamp.",
            2.0,
            angle,
            1200,
        )
