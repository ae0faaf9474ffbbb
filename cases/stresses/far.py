"""Shapes of size 1 m from ever farther away, framed to fill the image.

B^2 - 4 A C and its like subtract squares that grow with (distance / size)^2 while their difference stays near one, so
float32 has nothing left at 4096 sizes. Source: Haines, Günther and Akenine-Möller, "Precision Improvements for
Ray/Sphere Intersection", Ray Tracing Gems (2019), chapter 7.
"""

from collections.abc import Callable, Iterator
from math import atan, degrees

from rayproof.cases.placement import camera_around
from rayproof.cases.scene import Cube, PointLight, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stresses import HEIGHT, STRESSES, VIEWS, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))
DISTANCES = {"1e1": 1e1, "1e3": 1e3, "1e5": 1e5}  # m
CORNERS = ((-1.0, -0.75, 0.25), (0.875, -0.5, -0.5), (0.125, 1.0, 0.375))  # m
MARGIN = 1.15  # of the image's half-height over the shape's reach
SHAPES: dict[str, tuple[Shape, tuple[str, ...]]] = {
    "sphere": (Sphere(albedo=ALBEDO), ("sphere", "sphere_normal", "position")),
    "cube": (Cube(albedo=ALBEDO), ("cube", "cube_normal", "position")),
    "square": (Square(albedo=ALBEDO, two_sided=True), ("square", "position")),
    "triangle": (Triangle(albedo=ALBEDO, vertices=CORNERS, two_sided=True), ("triangle", "position")),
}  # fmt: skip


def framed(shape: Shape, distance: float) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes of a shape about the origin, seen from `distance` [m] in several directions."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        camera = camera_around(
            (0.0, 0.0, 0.0),
            distance=distance,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            fovy=2 * degrees(atan(MARGIN / distance)),
            near=distance / 10,
            far=distance * 10,
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


def family(shape: Shape, distance: float) -> Callable[[], Iterator[tuple[str, Scene]]]:
    """Return the family of one shape at one distance."""
    return lambda: framed(shape, distance)


for _kind, (_shape, _slots) in SHAPES.items():
    for _label, _distance in DISTANCES.items():
        STRESSES.register(f"far_{_kind}_{_label}", slots=_slots)(family(_shape, _distance))
