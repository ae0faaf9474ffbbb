"""Pixels as averages: 8 x 8 samples on a regular grid against the box filter of an image renderer."""

from collections.abc import Iterator

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Cube, PointLight, Scene, Shape, Sphere, Square

SAMPLES = 8  # per side of a pixel
FLOOR = Square(
    albedo=(0.6, 0.5, 0.4),
    to_world=compose(translation(0.1, 0.2, -0.9), rotation((0.8, 0.5, 0.1), 10), scaling(7, 6, 1)),
)


@CASE_FAMILIES.register("antialiased")
def antialiased() -> Iterator[Case]:
    """Yield a round and an angular object over a floor."""
    sphere = Sphere(albedo=(0.3, 0.6, 0.8), center=(0.2, -0.1, 0.1), radius=0.8)
    cube = Cube(
        albedo=(0.8, 0.4, 0.3),
        to_world=compose(translation(0.0, 0.1, 0.2), rotation((0.3, 0.6, 1.0), 48), scaling(1.2, 1.0, 1.1)),
    )
    camera = camera_around((0.0, 0.0, 0.0), distance=5.0, azimuth=-44, elevation=37, width=24, height=18, fovy=36)
    light = PointLight(position=(1.8, -1.2, 3.0), flux=(350.0, 420.0, 300.0))
    solids: tuple[tuple[str, Shape], ...] = (("sphere", sphere), ("cube", cube))
    for name, solid in solids:
        scene = Scene(camera=camera, shapes=(FLOOR, solid), lights=(light,))
        yield Case(
            name=f"antialiased/{name}",
            scene=scene,
            stresses=f"A {name} and its shadow with 64 samples in every pixel: outlines become averages.",
            covers=covering(scene, "LIT-4"),
            least_interior=200,
            most_edge=0.05,
            samples=SAMPLES,
        )
