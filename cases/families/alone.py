"""One body and nothing else, lit so that it stands in its own light: nothing but the body itself can be in the way."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Mesh, PointLight, Scene, Shape, Sphere, Vector
from rayproof.cases.stages import Stage

ALBEDO = (0.6, 0.45, 0.7)
FLUX = (420.0, 510.0, 360.0)  # W
OUTSIDE: Vector = (0.9, -2.9, 3.1)
# A valley between two slopes, the higher one towards the light.
VALLEY = np.array(
    ((-1.6, -1.2, 1.1), (1.5, -1.1, 1.2), (1.4, 0.1, -0.2), (-1.5, -0.1, -0.1), (1.6, 1.5, 0.5), (-1.4, 1.6, 0.4))
)
SLOPES = np.array(((0, 2, 3), (0, 1, 2), (3, 4, 5), (3, 2, 4)))


@CASE_FAMILIES.register("alone")
def alone() -> Iterator[Case]:
    """Yield a two-sided ball and box seen from within and lit from outside, then a valley that shades itself."""
    within = camera_around((0.1, 0.0, -0.1), distance=0.7, azimuth=25, elevation=-20, width=56, height=42, fovy=70)
    placed = compose(translation(0.1, 0.1, 0.0), rotation((0.3, 0.7, -0.4), 27))
    ball = Sphere(albedo=ALBEDO, center=(0.1, 0.05, -0.1), radius=1.9, two_sided=True)
    box = Cube(albedo=ALBEDO, to_world=compose(placed, scaling(3.1, 2.9, 3.3)), two_sided=True)
    dark: tuple[tuple[str, str, Shape], ...] = (
        ("two_sided_sphere", "Inside a two-sided sphere, the light outside: its own wall keeps all light out.", ball),
        ("two_sided_cube", "Inside a two-sided cube, the light outside: its own wall keeps all light out.", box),
    )
    light = PointLight(position=OUTSIDE, flux=FLUX)
    for name, stresses, body in dark:
        scene = Scene(camera=within, shapes=(body,), lights=(light,))
        yield Case(
            name=f"alone/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=1500,
            most_edge=0.1,
            expectations=tuple(_black(channel) for channel in range(3)),
        )
    above: Camera = camera_around(
        (0.0, 0.2, 0.2), distance=2.1, azimuth=80, elevation=52, width=64, height=48, fovy=92
    )  # fmt: skip
    valley = Mesh(albedo=ALBEDO, vertices=VALLEY, faces=SLOPES)
    low = PointLight(position=(0.3, -3.4, 2.1), flux=FLUX)
    scene = Scene(camera=above, shapes=(valley,), lights=(low,))
    yield Case(
        name="alone/concave_mesh",
        scene=scene,
        stresses="A valley, the light low behind its higher slope: half of it lies in its own shadow.",
        covers=covering(scene),
        least_interior=800,
        most_edge=0.1,
    )


def _black(channel: int) -> UniformValue:
    return UniformValue(
        stage=Stage.RADIANCE, shape=0, channel=channel, value=0.0, relative=0.0, because="its wall is before the light"
    )
