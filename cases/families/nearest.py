"""Families `nearest` (crowds, layers, coincident and interpenetrating shapes) and `random_scenes`."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import FEW_EXPLAINED, Case, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation, vector
from rayproof.cases.scene import Cube, Matrix, Mesh, PointLight, Scene, Shape, Sphere, Square, Triangle

# The nearest of many surfaces: crowds of small shapes, thin layers, intersecting solids, coincident surfaces.
SEED = 20060171


def crowd_of_spheres(count: int) -> tuple[Shape, ...]:
    """Return `count` spheres in a box of 3 m, overlapping in the image."""
    generator = np.random.default_rng(SEED)
    return tuple(
        Sphere(
            albedo=vector(generator.uniform(0.2, 0.9, 3)),
            center=vector(generator.uniform(-1.4, 1.4, 3)),
            radius=float(generator.uniform(0.12, 0.35)),
        )
        for _ in range(count)
    )


def crowd_of_cubes(count: int) -> tuple[Shape, ...]:
    """Return `count` cubes in a box of 3 m, each with its own rotation and scaling."""
    generator = np.random.default_rng(SEED + 1)

    def place() -> Matrix:
        return compose(
            translation(*vector(generator.uniform(-1.4, 1.4, 3))),
            rotation(vector(generator.normal(size=3)), float(generator.uniform(0, 180))),
            scaling(*vector(generator.uniform(0.25, 0.6, 3))),
        )

    return tuple(Cube(albedo=vector(generator.uniform(0.2, 0.9, 3)), to_world=place()) for _ in range(count))


def layers(count: int, gap: float) -> tuple[Shape, ...]:
    """Return `count` parallel squares `gap` [m] apart, each smaller than the one behind it."""
    frame = compose(translation(0.1, -0.1, 0.2), rotation((0.6, -0.4, 0.5), 33))
    return tuple(
        Square(
            albedo=(0.9 - 0.1 * index, 0.3, 0.2 + 0.1 * index),
            to_world=compose(
                frame,
                translation(0.03 * index, -0.02 * index, gap * index),
                rotation((0, 0, 1), 11.0 * index),
                scaling(2.6 - 0.35 * index, 2.4 - 0.3 * index, 1),
            ),
        )
        for index in range(count)
    )


def coincident() -> tuple[Shape, ...]:
    """Return two squares that share a part of one plane, turned against each other, and a ball on the same plane."""
    frame = compose(translation(0.1, -0.1, 0.2), rotation((0.6, -0.4, 0.5), 33))
    turned = compose(frame, translation(0.7, 0.5, 0), rotation((0, 0, 1), 27), scaling(1.1, 0.8, 1))
    return (
        Square(albedo=(0.8, 0.4, 0.3), to_world=compose(frame, scaling(2.6, 2.2, 1))),
        Square(albedo=(0.3, 0.5, 0.8), to_world=turned),
        Sphere(albedo=(0.4, 0.7, 0.3), to_world=compose(frame, translation(-0.5, -0.4, 0.5), scaling(0.5, 0.5, 0.5))),
    )


def interpenetrating() -> tuple[Shape, ...]:
    """Return two spheres and two cubes around one point."""
    return (
        Sphere(albedo=(0.8, 0.3, 0.3), center=(0.3, -0.2, 0.1), radius=0.9),
        Sphere(albedo=(0.3, 0.8, 0.4), center=(-0.5, 0.4, 0.3), radius=0.8),
        Cube(
            albedo=(0.3, 0.4, 0.9),
            to_world=compose(translation(0.1, -0.1, 0.2), rotation((0.5, 1.0, 0.3), 40), scaling(1.5, 1.3, 1.4)),
        ),
        Cube(
            albedo=(0.8, 0.7, 0.2),
            to_world=compose(translation(-0.2, 0.2, -0.4), rotation((1.0, -0.4, 0.6), 65), scaling(1.2, 1.8, 0.9)),
        ),
    )


def nearest() -> Iterator[Case]:
    """Yield crowds, layers, intersecting and coincident shapes; the last two are lit."""
    camera = camera_around((0.0, 0.0, 0.1), distance=6.0, azimuth=-57, elevation=28, width=96, height=72, fovy=29)
    light = PointLight(position=(2.4, -2.9, 3.2), flux=(500.0, 420.0, 360.0))
    questions: tuple[tuple[str, str, tuple[Shape, ...], tuple[PointLight, ...], tuple[str, ...], int], ...] = (
        ("spheres", "Forty small spheres, many behind each other.", crowd_of_spheres(40), (), (), 1500),
        ("cubes", "Twenty-four turned cubes, many within each other.", crowd_of_cubes(24), (), (), 1200),
        ("layers", "Six squares a centimetre apart, nearest last.", layers(6, 0.01), (), ("HIT-8",), 1500),
        ("interpenetrating", "Spheres and cubes that pass through each other.", interpenetrating(), (), (), 1500),
        ("lit_crowd", "Spheres that shade each other.", crowd_of_spheres(14), (light,), ("LIT-2", "LIT-4"), 700),
        ("coincident", "Two squares in one plane: either may be seen.", coincident(), (light,), (), 1500),
    )  # fmt: skip
    for name, stresses, shapes, lights, more, least_interior in questions:
        scene = Scene(camera=camera, shapes=shapes, lights=lights)
        yield Case(
            name=f"nearest/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, *more),
            least_interior=least_interior,
            most_explained=0.09 if name == "coincident" else FEW_EXPLAINED,
        )


# Mixed scenes by seed: every kind of shape under a random placement, a floor, two lights, none selected by hand.
SEEDS = (1, 2, 3, 4, 5)
CORNERS = np.array(((0.6, 0.6, 0.6), (0.6, -0.6, -0.6), (-0.6, 0.6, -0.6), (-0.6, -0.6, 0.6)))
OUTWARD = np.array(((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)))


def placement(generator: np.random.Generator) -> Matrix:
    """Return a random placement: moved, turned, sheared, stretched and, half of the time, mirrored."""
    stretch = generator.uniform(0.6, 1.2, 3)
    stretch[0] *= generator.choice((-1.0, 1.0))
    slant = generator.uniform(-0.35, 0.35, 3)
    return compose(
        translation(*vector(generator.uniform((-1.5, -1.5, -0.2), (1.5, 1.5, 1.2)))),
        rotation(vector(generator.normal(size=3)), float(generator.uniform(0, 180))),
        shear(xy=float(slant[0]), xz=float(slant[1]), yz=float(slant[2])),
        scaling(*vector(stretch)),
    )


def shapes(generator: np.random.Generator) -> tuple[Shape, ...]:
    """Return a floor and eight shapes, in a random order."""
    floor = Square(
        albedo=vector(generator.uniform(0.3, 0.8, 3)),
        to_world=compose(
            translation(0, 0, -1.2), rotation(vector(generator.normal(size=3)), 9), scaling(9, 8, 1)
        ),
    )  # fmt: skip
    mixed: list[Shape] = [floor]
    for kind in (Sphere, Sphere, Cube, Cube, Square, Triangle, Triangle, Mesh):
        common = {
            "albedo": vector(generator.uniform(0.2, 0.9, 3)),
            "to_world": placement(generator),
            "two_sided": bool(generator.random() < 0.4),
        }
        if kind is Sphere:
            mixed.append(Sphere(**common, radius=float(generator.uniform(0.3, 0.6))))
        elif kind is Triangle:
            mixed.append(Triangle(**common, vertices=tuple(map(vector, generator.uniform(-1, 1, (3, 3))))))  # pyright: ignore[reportArgumentType]
        elif kind is Mesh:
            mixed.append(Mesh(**common, vertices=CORNERS, faces=OUTWARD))
        else:
            mixed.append(kind(**common))
    return tuple(mixed[index] for index in generator.permutation(len(mixed)))


def random_scenes() -> Iterator[Case]:
    """Yield one case per seed."""
    for seed in SEEDS:
        generator = np.random.default_rng(seed)
        camera = camera_around(
            vector(generator.uniform(-0.2, 0.2, 3)),
            distance=float(generator.uniform(5.0, 7.0)),
            azimuth=float(generator.uniform(-180, 180)),
            elevation=float(generator.uniform(20, 55)),
            roll=float(generator.uniform(-40, 40)),
            fovy=float(generator.uniform(35, 50)),
            width=96,
            height=72,
        )
        lights = tuple(
            PointLight(
                position=vector(generator.uniform((-3, -3, 2.5), (3, 3, 4.5))),
                flux=vector(generator.uniform(150, 450, 3)),
            )
            for _ in range(2)
        )
        scene = Scene(camera=camera, shapes=shapes(generator), lights=lights)
        yield Case(
            name=f"random_scenes/seed_{seed}",
            scene=scene,
            stresses=f"A mixed scene that seed {seed} made: every kind of shape, every kind of motion, two lights.",
            covers=covering(scene, "CAM-5", "HIT-5", "HIT-8", "LIT-4"),
            least_interior=3000,
        )
