"""Mixed scenes by seed: every kind of shape under a random placement, a floor, two lights; none was hand-picked."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation
from rayproof.cases.scene import Cube, Matrix, Mesh, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector

SEEDS = (1, 2, 3, 4, 5)
CORNERS = np.array(((0.6, 0.6, 0.6), (0.6, -0.6, -0.6), (-0.6, 0.6, -0.6), (-0.6, -0.6, 0.6)))
OUTWARD = np.array(((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)))


def _vector(values: np.ndarray) -> Vector:
    x, y, z = map(float, values)
    return (x, y, z)


def placement(generator: np.random.Generator) -> Matrix:
    """Return a random placement: moved, turned, sheared, stretched and, half of the time, mirrored."""
    stretch = generator.uniform(0.6, 1.2, 3)
    stretch[0] *= generator.choice((-1.0, 1.0))
    slant = generator.uniform(-0.35, 0.35, 3)
    return compose(
        translation(*_vector(generator.uniform((-1.5, -1.5, -0.2), (1.5, 1.5, 1.2)))),
        rotation(_vector(generator.normal(size=3)), float(generator.uniform(0, 180))),
        shear(xy=float(slant[0]), xz=float(slant[1]), yz=float(slant[2])),
        scaling(*_vector(stretch)),
    )


def shapes(generator: np.random.Generator) -> tuple[Shape, ...]:
    """Return a floor and eight shapes, in a random order."""
    floor = Square(
        albedo=_vector(generator.uniform(0.3, 0.8, 3)),
        to_world=compose(
            translation(0, 0, -1.2), rotation(_vector(generator.normal(size=3)), 9), scaling(9, 8, 1)
        ),
    )  # fmt: skip
    mixed: list[Shape] = [floor]
    for kind in (Sphere, Sphere, Cube, Cube, Square, Triangle, Triangle, Mesh):
        common = {
            "albedo": _vector(generator.uniform(0.2, 0.9, 3)),
            "to_world": placement(generator),
            "two_sided": bool(generator.random() < 0.4),
        }
        if kind is Sphere:
            mixed.append(Sphere(**common, radius=float(generator.uniform(0.3, 0.6))))
        elif kind is Triangle:
            mixed.append(Triangle(**common, vertices=tuple(map(_vector, generator.uniform(-1, 1, (3, 3))))))  # pyright: ignore[reportArgumentType]
        elif kind is Mesh:
            mixed.append(Mesh(**common, vertices=CORNERS, faces=OUTWARD))
        else:
            mixed.append(kind(**common))
    return tuple(mixed[index] for index in generator.permutation(len(mixed)))


@CASE_FAMILIES.register("random_scenes")
def random_scenes() -> Iterator[Case]:
    """Yield one case per seed."""
    for seed in SEEDS:
        generator = np.random.default_rng(seed)
        camera = camera_around(
            _vector(generator.uniform(-0.2, 0.2, 3)),
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
                position=_vector(generator.uniform((-3, -3, 2.5), (3, 3, 4.5))),
                flux=_vector(generator.uniform(150, 450, 3)),
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
            most_edge=0.04,
        )
