"""Small scenes that several tests share."""

from typing import Any

import numpy as np
import trimesh

from rayproof.cases.scene import (
    Camera,
    Cube,
    Matrix,
    Mesh,
    Plane,
    PointLight,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)


def matrix(linear, offset=(0.0, 0.0, 0.0)) -> Matrix:
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = linear, offset
    rows: Any = tuple(tuple(map(float, row)) for row in placed)
    return rows


def camera(**changes) -> Camera:
    values: dict[str, Any] = {
        "eye": (0.3, -6.0, 2.1),
        "target": (0.0, 0.1, 0.2),
        "up": (0.1, 0.0, 1.0),
        "fovy": 50.0,
        "width": 24,
        "height": 18,
        "near": 0.1,
        "far": 100.0,
    }
    return Camera(**(values | changes))


def looking_down(above: float, **changes) -> Camera:
    """Return a camera over the origin, `above` metres high, whose central pixel (sizes are odd) looks straight down."""
    values = {"eye": (0.0, 0.0, above), "target": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "width": 15, "height": 11}
    return camera(**(values | changes))


def icosphere(subdivisions: int = 1, **changes) -> Mesh:
    ball: Any = trimesh.creation.icosphere(subdivisions=subdivisions)
    values: dict[str, Any] = {"albedo": (0.3, 0.5, 0.4)} | changes
    return Mesh(vertices=ball.vertices, faces=ball.faces, **values)


def triangle(vertices, **changes) -> Triangle:
    corners: Any = tuple(tuple(map(float, vertex)) for vertex in vertices)
    values: dict[str, Any] = {"albedo": (0.3, 0.5, 0.4)} | changes
    return Triangle(vertices=corners, **values)


def position(generator: np.random.Generator, *ranges: tuple[float, float]) -> Vector:
    x, y, z = (float(generator.uniform(low, high)) for low, high in ranges)
    return (x, y, z)


def random_scene(seed: int, *, width: int = 40, height: int = 30) -> Scene:
    """Return a floor with six random shapes of all kinds, sheared or mirrored, and three lights."""
    generator = np.random.default_rng(seed)
    shapes: list[Shape] = [Plane(albedo=(0.5, 0.4, 0.3), to_world=matrix(np.eye(3), (0, 0, -1.2)))]
    kinds = [Sphere, Cube, Square, Triangle, Mesh, Sphere, Cube]
    for kind in kinds:
        linear = np.linalg.qr(generator.normal(size=(3, 3)))[0] @ np.diag(generator.uniform(0.4, 1.3, 3))
        linear = linear @ (np.eye(3) + np.triu(generator.uniform(-0.3, 0.3, (3, 3)), 1))
        common: dict[str, Any] = {
            "albedo": tuple(generator.uniform(0.1, 0.9, 3)),
            "two_sided": bool(generator.integers(2)),
            "to_world": matrix(linear, generator.uniform(-1.8, 1.8, 3)),
        }
        if kind is Triangle:
            shapes.append(triangle(generator.uniform(-1.5, 1.5, (3, 3)), **common))
        elif kind is Mesh:
            shapes.append(icosphere(int(generator.integers(3)), **common))
        elif kind is Square:
            stretched = matrix(linear * 2, generator.uniform(-1.5, 1.5, 3))
            common["to_world"] = stretched
            shapes.append(Square(**common))
        else:
            shapes.append(kind(**common))
    lights = tuple(
        PointLight(position=position(generator, (-4, 4), (-4, 4), (0.5, 5)), flux=flux)
        for flux in ((100.0, 50.0, 20.0), (10.0, 90.0, 70.0), (30.0, 30.0, 0.0))
    )
    clip = ("depth", "shell", "none")[seed % 3]
    near, far = ((4.5, 8.0), (0.1, 100.0))[seed % 2]
    view = camera(
        eye=position(generator, (-3, 3), (-6, -6), (-0.5, 4)),
        width=width,
        height=height,
        near=near,
        far=far,
    )
    return Scene(camera=view, shapes=tuple(shapes), lights=lights, clip=clip)
