"""More than eight shapes of a kind: a renderer may well put them into a tree, which it does not for a few.

Every shape of a crowd stands by itself in the image and has an albedo of its own: one that is lost, or that takes
another's colour, shows.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation
from rayproof.cases.scene import Cube, Matrix, Mesh, PointLight, Scene, Shape, Sphere, Square, Triangle

SEED = 16
MANY = 9  # of a kind
CAMERA = camera_around((0.0, 0.0, 0.0), distance=6.5, azimuth=-62, elevation=48, width=64, height=48, fovy=33)
LIGHT = PointLight(position=(0.9, -1.3, 4.2), flux=(430.0, 500.0, 380.0))
FLOOR = Square(
    albedo=(0.5, 0.55, 0.6),
    to_world=compose(translation(0.1, 0.0, -0.7), rotation((0.6, 1.0, 0.2), 5), scaling(7, 6, 1)),
)
TETRAHEDRON = np.array(((0.5, 0.4, -0.3), (-0.5, 0.3, -0.2), (0.1, -0.5, -0.3), (0.0, 0.1, 0.5)))
OUTWARD = np.array(((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
CORNERS = ((-0.5, -0.4, 0.05), (0.5, -0.45, -0.05), (0.05, 0.55, 0.1))


def places(count: int, *, shift: float = 0.0) -> tuple[tuple[float, float, float], ...]:
    """Return `count` places in rows of five, a little out of line [m]."""
    moved = np.random.default_rng(SEED).uniform(-0.1, 0.1, (count, 3))
    across = 0.95 * (np.arange(count) % 5) - 1.9 + shift
    along = 1.0 * (np.arange(count) // 5) - 0.5 * ((count - 1) // 5)
    found = moved + np.stack([across, along, np.zeros(count)], axis=1)
    return tuple((float(x), float(y), float(z)) for x, y, z in found)


def color(number: int, count: int) -> tuple[float, float, float]:
    """Return an albedo that differs from every other number's in each channel."""
    share = number / count
    return (0.2 + 0.7 * share, 0.9 - 0.6 * share, 0.25 + 0.6 * ((3 * number) % count) / count)


def turned(place: tuple[float, float, float], number: int, size: tuple[float, float, float]) -> Matrix:
    """Return where a shape of that number stands: turned by an angle of its own."""
    return compose(translation(*place), rotation((0.4, 0.3, 1.0), 17.0 + 31.0 * number), scaling(*size))


def _balls(count: int) -> Iterator[Shape]:
    for k, place in enumerate(places(count)):
        yield Sphere(albedo=color(k, count), center=place, radius=0.33 + 0.01 * k)


def _ellipsoids(count: int) -> Iterator[Shape]:
    for k, place in enumerate(places(count)):
        yield Sphere(albedo=color(k, count), radius=0.5, to_world=turned(place, k, (0.85, 0.6, 0.7)))


def _cubes(count: int) -> Iterator[Shape]:
    for k, place in enumerate(places(count)):
        yield Cube(albedo=color(k, count), to_world=turned(place, k, (0.5, 0.6, 0.45)))


def _squares(count: int) -> Iterator[Shape]:
    """Yield squares that lean, those after the first `count` sheared as well."""
    for k, place in enumerate(places(count + 3)):
        leaning = compose(translation(*place), rotation((1.0, 0.2 * k - 0.7, 0.1), 25), scaling(0.75, 0.65, 1.0))
        skewed = leaning if k < count else compose(leaning, shear(xy=0.4))
        yield Square(albedo=color(k, count + 3), to_world=skewed, two_sided=k % 2 == 0)


def _triangles(count: int) -> Iterator[Shape]:
    for k, place in enumerate(places(count)):
        leaning = compose(translation(*place), rotation((1.0, 0.2 * k - 0.7, 0.1), 20))
        yield Triangle(albedo=color(k, count), vertices=CORNERS, to_world=leaning)


@CASE_FAMILIES.register("crowds")
def crowds() -> Iterator[Case]:
    """Yield nine of each kind, spheres beside a mesh, and nine shapes of which no kind has more than five."""
    mesh = Mesh(albedo=(0.7, 0.5, 0.4), vertices=TETRAHEDRON, faces=OUTWARD, to_world=translation(1.7, 0.5, 0.0))
    mixed = (*tuple(_balls(10))[:5], *tuple(_cubes(10))[5:9])
    scenes: tuple[tuple[str, str, tuple[Shape, ...]], ...] = (
        ("spheres_beside_a_mesh", "Nine spheres, and a mesh among them.", (*_balls(MANY), mesh)),
        ("ellipsoids", "Nine ellipsoids, each turned and stretched in its own way.", tuple(_ellipsoids(MANY))),
        ("cubes", "Nine boxes, each turned in its own way.", tuple(_cubes(MANY))),
        ("squares", "Nine squares, and three sheared ones.", tuple(_squares(MANY))),
        ("triangles", "Nine triangles.", tuple(_triangles(MANY))),
        ("of_several_kinds", "Five spheres and four boxes: many shapes, and few of a kind.", mixed),
    )
    for name, stresses, shapes in scenes:
        scene = Scene(camera=CAMERA, shapes=(*shapes, FLOOR), lights=(LIGHT,))
        yield Case(
            name=f"crowds/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=600,
            most_edge=0.2,
        )
