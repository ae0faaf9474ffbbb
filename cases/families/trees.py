"""Families `crowds`, `faces` and `benchmarked`: enough shapes or faces for a renderer to put them into a tree."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.benchmark_scenes import chosen
from rayproof.cases.case import Case, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation, vector
from rayproof.cases.scene import Cube, Matrix, Mesh, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector

# More than eight shapes of a kind: a renderer may well put them into a tree, which it does not for a few.
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
    return tuple(map(vector, moved + np.stack([across, along, np.zeros(count)], axis=1)))


def color(number: int, count: int) -> tuple[float, float, float]:
    """Return an albedo that differs from every other number's in each channel."""
    share = number / count
    return (0.2 + 0.7 * share, 0.9 - 0.6 * share, 0.25 + 0.6 * ((3 * number) % count) / count)


def turned(place: tuple[float, float, float], number: int, size: tuple[float, float, float]) -> Matrix:
    """Return the matrix of the shape with that number: at `place`, turned by an angle of its own."""
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


def crowds() -> Iterator[Case]:
    """Yield nine shapes of each kind, spheres next to a mesh, and nine shapes with at most five of a kind.

    The shapes of a crowd do not overlap in the image and have different albedos, so that a lost shape, or one with the
    colour of another, is visible.
    """
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
        )


# Numbers of faces at which a tree has another shape: one, nine, 1025, and more than 2^16.
ALBEDO = (0.65, 0.7, 0.45)
FACES_LIGHT = PointLight(position=(0.8, -0.7, 4.1), flux=(400.0, 330.0, 460.0))
TURN = compose(translation(0.05, -0.03, 0.1), rotation((0.4, 1.0, 0.3), 12))
WIDE = np.array(((-3.0, -2.2, 0.0), (3.4, -2.5, 0.1), (0.1, 4.5, -0.1)))  # fills the frame
LARGE = np.array(((-0.45, -0.4, 0.0), (0.5, -0.35, 0.05), (0.0, 0.55, -0.05)))
ROWS = 3  # of large faces

Corners = np.ndarray  # (faces, 3, 3) [m]


def mesh_of(corners: Corners, *, two_sided: bool = False) -> Mesh:
    """Return a mesh whose faces share no vertex."""
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Mesh(albedo=ALBEDO, vertices=corners.reshape(-1, 3), faces=faces, to_world=TURN, two_sided=two_sided)


def apart(count: int) -> Corners:
    """Return large faces in rows of three, each by itself."""
    places = np.arange(count)
    offsets = np.stack([1.15 * (places % ROWS - 1), 1.05 * (places // ROWS - 1), 0.04 * places], axis=1)
    return LARGE + offsets[:, np.newaxis]


def among(count: int) -> Corners:
    """Return `count` faces: nine large ones, the first, the middle and the last of them, and a strip of small ones."""
    large = apart(9)
    small = count - len(large)
    across = int(np.ceil(np.sqrt(6 * small)))  # the strip is some six times as long as it is wide
    step = 3.4 / across
    column, row = np.arange(small) % across, np.arange(small) // across
    heights = 0.02 * np.sin(40 * step * column)
    offsets = np.stack([-1.7 + step * column, -1.65 - step * row, heights], axis=1)
    crumbs = 0.8 * step * LARGE + offsets[:, np.newaxis]
    middle = small // 2
    return np.concatenate([large[:3], crumbs[:middle], large[3:6], crumbs[middle:], large[6:]])


def behind(depths: Sequence[float]) -> Corners:
    """Return faces that fill the frame at those heights, each smaller than the face below it."""
    shrink = {depth: 0.9 - 0.8 * rank / len(depths) for rank, depth in enumerate(sorted(depths))}
    return np.stack([WIDE * (shrink[depth], shrink[depth], 1.0) * 0.7 + (0.0, 0.0, depth) for depth in depths])


def faces() -> Iterator[Case]:
    """Yield meshes of one, five, nine, 1025 and 2^16 + 9 faces; images with an odd number of pixels are 65 wide.

    The first, the middle and the last face of a mesh are large, the others small: each of the three leaves a large hole
    if it is lost.
    """
    target: Vector = (0.0, -0.15, 0.0)
    even = camera_around(target, distance=6.0, azimuth=-95, elevation=70, width=64, height=48, fovy=38)
    small = camera_around(target, distance=6.0, azimuth=-95, elevation=70, width=44, height=33, fovy=38)
    odd = camera_around(target, distance=6.0, azimuth=-95, elevation=70, width=65, height=49, fovy=38)
    close = camera_around(target, distance=3.2, azimuth=-95, elevation=70, width=65, height=49, fovy=38)
    stacked = behind((-0.4, 0.5, -0.1, 0.8, 0.2))
    named = {
        "one": "One face that fills the frame: a tree of a single leaf, 65 pixels wide.",
        "above_each_other": "Five faces above each other, in no order, each seen at its rim.",
        "nine": "Nine faces, one more than a power of two, in an image of odd width and height.",
        "thousand_and_25": "1025 faces, one more than a power of two; three large ones are the last.",
        "over_two_to_the_16": "2^16 + 9 faces, most of them smaller than a pixel; three large ones are the last.",
    }
    questions = (
        ("one", close, WIDE[np.newaxis], 2500),
        ("above_each_other", odd, stacked, 900),
        ("nine", odd, apart(9), 500),
        ("thousand_and_25", even, among(1025), 500),
        ("over_two_to_the_16", small, among(2**16 + 9), 200),
    )
    for name, camera, corners, least_interior in questions:
        scene = Scene(camera=camera, shapes=(mesh_of(corners, two_sided=name == "one"),), lights=(FACES_LIGHT,))
        yield Case(
            name=f"faces/{name}",
            scene=scene,
            stresses=named[name],
            covers=covering(scene),
            least_interior=least_interior,
        )


# The benchmark's scenes, large enough to be traced as the benchmark traces them: several samples a lane.
WIDTH, HEIGHT = 512, 256  # px
FEWER, LARGER = 25, 3.0


def _scene(name: str) -> Scene:
    (bench,) = chosen((name,), quick=False)
    return bench.scene(WIDTH, HEIGHT)


def _some_spheres() -> Scene:
    scene = _scene("thousand_spheres")
    spheres = [shape for shape in scene.shapes[:FEWER] if isinstance(shape, Sphere)]
    return replace(scene, shapes=tuple(replace(sphere, radius=LARGER * sphere.radius) for sphere in spheres))


def benchmarked() -> Iterator[Case]:
    """Yield unrolled shapes, eight and four samples in a row; spheres and triangles in a tree, tiles of sixteen.

    Half the benchmark's size is enough pixels for these plans. Of the thousand spheres only as many are used as a tree
    needs, since a closed form tests each sphere at every pixel; they are larger, and a pixel may show none of them.
    """
    questions: tuple[tuple[str, Scene, str, int], ...] = (
        (
            "sphere_and_floor",
            _scene("sphere_and_floor"),
            "Eight samples a lane, which goes past what none of them can meet.",
            100_000,
        ),
        ("spheres_and_cubes", _scene("spheres_and_cubes"), "Twenty unrolled shapes and four samples a lane.", 12_000),
        ("some_spheres", _some_spheres(), "Spheres in a tree, sixteen rays as one beam.", 10_000),
        ("bumpy_1k", _scene("bumpy_1k"), "A mesh of 1280 faces that shades itself, sixteen rays as one beam.", 30_000),
    )
    for name, scene, stresses, least_interior in questions:
        yield Case(
            name=f"benchmarked/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=least_interior,
        )
