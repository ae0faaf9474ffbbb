"""Flux conservation after CIE 171:2006: what a source emits in a closed room arrives on its six faces.

10 000 lm from the centre of a room 4 x 4 x 3 m: 2210.657 on floor and ceiling, 1394.672 on each 4 x 3 m wall, from the
solid angle of a rectangle seen from above its centre (Gershun, The Light Field, 1939). Every case sees one face
frontally, so that its pixels are equal squares and their sum is a midpoint rule.
"""

from collections.abc import Iterator
from math import atan, pi, sqrt

from rayproof.cases.case import Case, Flux, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import compose, frontal_fovy, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Camera, PointLight, Scene, Shape, Square, Vector

FLUX = (10_000.0, 4_000.0, 1_500.0)  # lm, stored as W; the first channel is the test's
MIDDLE: Vector = (0.0, 0.0, 1.5)  # m
PIXEL = 0.05  # m
BACK = 1.25  # m; the camera stands so far behind the source, seen from the face
ROUNDINGS = 80  # of camera ray (20), hit (15), feeler (15), cosine and falloff (15), and the slant of the hit (15)

# Name, the face's rotation from z = 0 facing +z, its two sizes [m], its distance from the middle [m], image size [px].
FACES: tuple[tuple[str, Vector, float, tuple[float, float], float, tuple[int, int]], ...] = (
    ("floor", (1.0, 0.0, 0.0), 0.0, (4.0, 4.0), 1.5, (96, 80)),
    ("ceiling", (1.0, 0.0, 0.0), 180.0, (4.0, 4.0), 1.5, (96, 80)),
    ("north", (1.0, 0.0, 0.0), 90.0, (4.0, 3.0), 2.0, (80, 60)),
    ("south", (1.0, 0.0, 0.0), -90.0, (4.0, 3.0), 2.0, (80, 60)),
    ("west", (0.0, 1.0, 0.0), 90.0, (3.0, 4.0), 2.0, (80, 60)),
    ("east", (0.0, 1.0, 0.0), -90.0, (3.0, 4.0), 2.0, (80, 60)),
)


def face(axis: Vector, angle: float, sizes: tuple[float, float], distance: float) -> Shape:
    """Return a square that looks at the middle of the room from `distance` [m]."""
    placed = compose(
        translation(*MIDDLE), rotation(axis, angle), translation(0, 0, -distance), scaling(sizes[0], sizes[1], 1)
    )
    return Square(albedo=(0.5, 0.4, 0.6), to_world=placed)


def share(sizes: tuple[float, float], distance: float) -> float:
    """Return the share of the sphere that a rectangle fills, seen from `distance` above its centre."""
    a, b = sizes[0] / 2, sizes[1] / 2
    return 4 * atan(a * b / (distance * sqrt(a * a + b * b + distance * distance))) / (4 * pi)


def midpoint_bound(sizes: tuple[float, float], distance: float) -> float:
    """Return a bound on the midpoint rule's error relative to the flux.

    The rule errs by at most area pixel^2 / 24 (max |E_xx| + max |E_yy|); both derivatives of I h / d^3 are largest in
    the middle, 3 I / h^4 (Davis and Rabinowitz, Methods of Numerical Integration, 1984, section 2.1).
    """
    error = sizes[0] * sizes[1] * PIXEL**2 / 24 * 2 * 3 / (4 * pi) / distance**4
    return error / share(sizes, distance)


@CASE_FAMILIES.register("flux_conservation")
def flux_conservation() -> Iterator[Case]:
    """Yield one case per face of the room."""
    room = tuple(face(axis, angle, sizes, distance) for _, axis, angle, sizes, distance, _ in FACES)
    source = PointLight(position=MIDDLE, flux=FLUX)
    for index, (name, _, _, sizes, distance, (width, height)) in enumerate(FACES):
        matrix = room[index].to_world
        normal = (matrix[0][2], matrix[1][2], matrix[2][2])
        x, y, z = (middle + BACK * component for middle, component in zip(MIDDLE, normal, strict=True))
        camera = Camera(
            eye=(x, y, z),
            target=MIDDLE,
            up=(0.0, 0.0, 1.0) if abs(normal[2]) < 0.5 else (0.0, 1.0, 0.0),
            fovy=frontal_fovy(height=height, pixel=PIXEL, distance=BACK + distance),
            width=width,
            height=height,
            near=0.1,
            far=20.0,
        )
        scene = Scene(camera=camera, shapes=room, lights=(source,))
        bound = midpoint_bound(sizes, distance)
        yield Case(
            name=f"flux_conservation/{name}",
            scene=scene,
            stresses=f"The {name} of a closed room receives its solid angle's share of the flux from the middle.",
            covers=covering(scene, "HIT-8", "LIT-2", "LIT-3", "LIT-4"),
            least_interior=4000,
            most_edge=0.05,
            expectations=tuple(
                Flux(
                    shape=index,
                    face=-1,
                    channel=channel,
                    footprint=PIXEL**2,
                    value=flux * share(sizes, distance),
                    relative=bound + gamma(ROUNDINGS, precision="float32"),
                    because=f"CIE 171:2006, flux conservation; the midpoint rule's bound {bound:.2g} and "
                    f"{ROUNDINGS} float32 roundings",
                )
                for channel, flux in enumerate(FLUX)
            ),
        )
