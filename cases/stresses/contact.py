"""Blockers a thousandth of the scene's scale above a floor, from a tenth of a millimetre to a thousand kilometres.

A feeler that starts too high leaks light under the blocker; one that starts too low shadows itself.
"""

from collections.abc import Iterator

from rayproof.cases.placement import camera_around, compose, scaling, translation
from rayproof.cases.scene import Plane, PointLight, Scene, Square
from rayproof.cases.stresses import HEIGHT, STRESSES, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
GAP = 2.0**-10  # of the scale


def contact(scale: float) -> Iterator[tuple[str, Scene]]:
    """Yield a tile that hovers GAP above a floor of the given scale [m], lit from the side."""
    for number, (azimuth, elevation) in enumerate(((20.0, 30.0), (115.0, 50.0), (200.0, 20.0)), start=1):
        away = (0.3 * scale, -0.2 * scale, 0.7 * scale)
        tile = Square(
            albedo=ALBEDO,
            two_sided=True,
            to_world=compose(
                translation(away[0], away[1], away[2] + GAP * scale), scaling(0.5 * scale, 0.5 * scale, 1.0)
            ),
        )
        camera = camera_around(
            away,
            distance=2.0 * scale,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            near=0.01 * scale,
            far=100.0 * scale,
        )
        floor = Plane(albedo=ALBEDO, to_world=translation(*away))
        light = PointLight(position=(1.3 * scale, 0.4 * scale, 2.7 * scale), flux=(scale**2, scale**2, scale**2))
        yield f"view_{number}", Scene(camera=camera, shapes=(floor, tile), lights=(light,))


SLOTS = ("feeler", "segment", "obstructed", "horizon", "falloff", "lambert")


@STRESSES.register("contact_1e-4", slots=SLOTS)
def contact_small() -> Iterator[tuple[str, Scene]]:
    """Yield contacts in a scene of 1e-4 m."""
    yield from contact(1e-4)


@STRESSES.register("contact_1", slots=SLOTS)
def contact_middle() -> Iterator[tuple[str, Scene]]:
    """Yield contacts in a scene of 1 m."""
    yield from contact(1.0)


@STRESSES.register("contact_1e6", slots=SLOTS)
def contact_large() -> Iterator[tuple[str, Scene]]:
    """Yield contacts in a scene of 1e6 m."""
    yield from contact(1e6)
