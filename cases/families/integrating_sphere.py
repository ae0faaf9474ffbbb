"""A light in the centre of a two-sided sphere: every point of the wall has radiance rho I / (pi r^2), exactly.

The wall is everywhere at distance r and meets the light head-on (Ulbricht's sphere without its interreflection;
Walsh, Photometry, 3rd ed. (1958), chapter 6).
"""

from collections.abc import Iterator
from math import pi

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import IDENTITY, Matrix, PointLight, Scene, Sphere, Vector
from rayproof.cases.stages import Stage

ALBEDO = (0.8, 0.6, 0.35)
FLUX = (500.0, 320.0, 640.0)  # W
CENTER: Vector = (0.3, -0.2, 0.15)  # m, in object space
RADIUS = 1.6  # m, in object space
ROUNDINGS = 100  # of camera ray (20), root (25), both ways through the matrix (20), feeler (10), square (10), rest (15)
PLACEMENTS: tuple[tuple[str, float, Matrix], ...] = (
    ("as_given", 1.0, IDENTITY),
    ("scaled", 1.75, compose(translation(0.9, -0.6, 0.4), rotation((0.2, 0.9, -0.4), 63), scaling(1.75, 1.75, 1.75))),
    ("mirrored", 1.25, compose(translation(-0.7, 0.5, 0.3), rotation((0.6, 0, 0.8), 44), scaling(1.25, -1.25, 1.25))),
)  # fmt: skip


@CASE_FAMILIES.register("integrating_sphere")
def integrating_sphere() -> Iterator[Case]:
    """Yield one case per placement of the sphere."""
    for name, scale, to_world in PLACEMENTS:
        middle = mapped(to_world, CENTER)
        radius = scale * RADIUS
        camera = camera_around(
            (middle[0] + 0.2, middle[1] - 0.1, middle[2] + 0.1),
            distance=0.55 * radius, azimuth=-25, elevation=20, width=72, height=64, fovy=95,
        )  # fmt: skip
        sphere = Sphere(albedo=ALBEDO, center=CENTER, radius=RADIUS, to_world=to_world, two_sided=True)
        scene = Scene(camera=camera, shapes=(sphere,), lights=(PointLight(position=middle, flux=FLUX),))
        irradiance = 1 / (4 * pi * radius**2)
        yield Case(
            name=f"integrating_sphere/{name}",
            scene=scene,
            stresses="A light in the centre of a two-sided sphere: one radiance over the whole image.",
            covers=covering(scene, "LIT-3", "LIT-4"),
            least_interior=4000,
            most_edge=0.01,
            expectations=tuple(
                UniformValue(
                    stage=stage,
                    shape=0,
                    channel=channel,
                    value=FLUX[channel] * irradiance * factor[channel],
                    relative=gamma(ROUNDINGS, precision="float32"),
                    because=f"Phi / (4 pi r^2), times rho / pi for radiance; float32: {ROUNDINGS} roundings",
                )
                for stage, factor in (
                    (Stage.IRRADIANCE, (1.0, 1.0, 1.0)),
                    (Stage.RADIANCE, tuple(albedo / pi for albedo in ALBEDO)),
                )
                for channel in range(3)
            ),
        )
