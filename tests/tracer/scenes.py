"""Small generic scenes for the tracer's tests: no axis-aligned frame, width != height, channels that differ."""

import dataclasses
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Cube, Matrix, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

ALBEDO = (0.5, 0.6, 0.7)


def camera(**changes: Any) -> Camera:
    """Return a camera that looks down at the origin's surroundings."""
    usual: dict[str, Any] = {
        "eye": (3.0, -6.0, 3.5),
        "target": (0.1, 0.2, 0.5),
        "up": (0.1, 0.05, 1.0),
        "fovy": 24.0,
        "width": 40,
        "height": 30,
        "near": 0.1,
        "far": 100.0,
    }
    return Camera(**{**usual, **changes})


def matrix(linear: np.ndarray, translation: tuple[float, float, float]) -> Matrix:
    """Return a 3x3 part and a translation [m] as a scene's matrix."""
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    x, y, z = translation
    return ((a, b, c, x), (d, e, f, y), (g, h, i, z), (0.0, 0.0, 0.0, 1.0))


def affine(seed: int, translation: tuple[float, float, float], *, mirror: bool = False) -> Matrix:
    """Return a rotated, sheared and unevenly scaled placement of about unit size."""
    generator = np.random.default_rng(seed)
    turn, tilt = (np.linalg.qr(generator.normal(size=(3, 3)))[0] for _ in range(2))
    linear = turn @ np.diag(generator.uniform(0.6, 1.4, 3)) @ tilt
    if (np.linalg.det(linear) < 0) != mirror:
        linear[:, 0] *= -1
    return matrix(linear, translation)


def octahedron(**changes: Any) -> Mesh:
    """Return a closed mesh of eight triangles with outward winding."""
    vertices = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=np.float32)
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    return Mesh(albedo=(0.2, 0.5, 0.3), vertices=vertices, faces=np.array(faces), **changes)


LIGHT = PointLight(position=(2.0, -3.0, 5.0), flux=(300.0, 200.0, 100.0))
SECOND_LIGHT = PointLight(position=(-3.0, -2.0, 4.0), flux=(30.0, 200.0, 500.0))
FLOOR = Plane(albedo=(0.3, 0.4, 0.8))

SHAPES: dict[str, Shape] = {
    "sphere": Sphere(albedo=ALBEDO, center=(0.2, 0.1, 0.3), to_world=affine(1, (-0.2, 0.1, 1.0))),
    "cube": Cube(albedo=ALBEDO, to_world=affine(2, (0.1, -0.2, 1.0))),
    "square": Square(albedo=ALBEDO, two_sided=True, to_world=affine(3, (0.2, 0.1, 0.9))),
    "plane": Plane(albedo=ALBEDO, two_sided=True, to_world=affine(4, (0.2, 0.3, 0.1))),
    "triangle": Triangle(
        albedo=ALBEDO,
        two_sided=True,
        vertices=((-1.0, -0.7, 0.1), (1.1, -0.5, 0.0), (0.1, 0.9, 0.4)),
        to_world=affine(5, (0.1, 0.2, 0.8)),
    ),
    "mesh": octahedron(to_world=affine(6, (0.1, 0.1, 1.0))),
}


def scene(*shapes: Shape, **changes: Any) -> Scene:
    """Return a scene of `shapes` under one light."""
    usual: dict[str, Any] = {"camera": camera(), "lights": (LIGHT,)}
    return Scene(shapes=shapes, **{**usual, **changes})


def everything(**changes: Any) -> Scene:
    """Return a scene with one of each shape, placed apart, on a floor."""
    places = ((-1.2, 0.0, 1.0), (1.2, 0.5, 1.0), (0.0, 1.5, 1.2), (0.3, -2.0, 0.8), (1.6, -1.2, 0.7))
    names = ("sphere", "cube", "square", "triangle", "mesh")
    moved = [
        dataclasses.replace(SHAPES[name], to_world=affine(20 + seed, place))
        for seed, (name, place) in enumerate(zip(names, places, strict=True))
    ]
    return scene(*moved, FLOOR, lights=(LIGHT, SECOND_LIGHT), **changes)


def shapes(generator: np.random.Generator, scale: float, moved: np.ndarray) -> tuple[Shape, ...]:
    """Return one shape of each kind and a second sphere, anywhere about `moved` [m], of any size below `scale` [m]."""

    def placed() -> tuple:
        # Stretched along the shape's own axes, or across them along the world's.
        stretch = scale * 10 ** generator.uniform(-2, 0.3, size=(1, 3))
        linear = np.linalg.qr(generator.normal(size=(3, 3)))[0] * (stretch if generator.random() < 0.5 else stretch.T)
        return matrix(linear, tuple((moved + scale * generator.uniform(-2, 2, size=3)).tolist()))

    return (
        Sphere(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Sphere(albedo=ALBEDO, center=(0.3, -0.2, 0.1), radius=0.7, to_world=placed()),
        Cube(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Square(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Triangle(albedo=ALBEDO, vertices=((-1.0, -0.7, 0.1), (1.1, -0.5, 0.0), (0.1, 0.9, 0.4)), to_world=placed()),
        Plane(albedo=ALBEDO, to_world=placed(), two_sided=True),
    )
