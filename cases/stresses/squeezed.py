"""Spheres and cubes squeezed by a hundred and by ten thousand along a skew axis: model matrices that lose digits."""

from collections.abc import Iterator
from math import degrees

from rayproof.cases.placement import camera_around, compose, rotation, scaling
from rayproof.cases.scene import Cube, PointLight, Scene, Sphere
from rayproof.cases.stresses import HEIGHT, STRESSES, VIEWS, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))


def squeezed(ratio: float) -> Iterator[tuple[str, Scene]]:
    """Yield a sphere or a cube, `ratio` times thinner along one axis than along another."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        matrix = compose(rotation((0.3, -0.5, 1.0), 37.0 * number), scaling(1.0, 0.5, 1.0 / ratio))
        shape = (Sphere if number % 2 else Cube)(albedo=ALBEDO, to_world=matrix)
        camera = camera_around(
            (0.0, 0.0, 0.0),
            distance=6.0,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            fovy=degrees(0.4),
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


SLOTS = ("to_object", "world_normal", "position", "cube", "sphere")


@STRESSES.register("squeezed_1e2", slots=SLOTS)
def squeezed_1e2() -> Iterator[tuple[str, Scene]]:
    """Yield shapes squeezed by 1e2."""
    yield from squeezed(1e2)


@STRESSES.register("squeezed_1e4", slots=SLOTS)
def squeezed_1e4() -> Iterator[tuple[str, Scene]]:
    """Yield shapes squeezed by 1e4."""
    yield from squeezed(1e4)
