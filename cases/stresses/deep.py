"""View frusta whose far plane lies 1e4 and 1e8 times beyond the near one, with the eye off the origin."""

from collections.abc import Iterator

from rayproof.cases.placement import camera_around
from rayproof.cases.scene import PointLight, Scene, Sphere
from rayproof.cases.stresses import HEIGHT, STRESSES, VIEWS, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))
SLOTS = ("ray", "half_extent", "basis", "view", "projection", "inverse", "corners")


def deep(ratio: float) -> Iterator[tuple[str, Scene]]:
    """Yield a sphere seen through a frustum of far / near = `ratio`."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        camera = camera_around(
            (0.5, -0.25, 0.125),
            distance=6.0,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            near=16.0 / ratio,
            far=16.0,
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO),), lights=(LIGHT,))


@STRESSES.register("deep_1e4", slots=SLOTS)
def deep_1e4() -> Iterator[tuple[str, Scene]]:
    """Yield frusta of far / near = 1e4."""
    yield from deep(1e4)


@STRESSES.register("deep_1e8", slots=SLOTS)
def deep_1e8() -> Iterator[tuple[str, Scene]]:
    """Yield frusta of far / near = 1e8."""
    yield from deep(1e8)
