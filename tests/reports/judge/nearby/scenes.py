"""Scenes in which rounding decides what one pixel shows, and answers to them."""

from dataclasses import replace

import numpy as np

from rayproof.cases.families.watertight import ORIGIN, beside, camera, net, wall
from rayproof.cases.placement import frontal_fovy, translation
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Shape, Square
from rayproof.cases.stages import Stage

GREY = (0.5, 0.4, 0.3)
SIZE, MIDDLE = 15, (7, 7)  # px; row and column of the middle pixel, whose ray goes to the origin
WIDTH, HEIGHT, VERTEX = 24, 16, (7, 11)


def above(*shapes: Shape, height: float = 4.0, lights: tuple[PointLight, ...] = (), **more) -> Scene:
    """Return shapes seen from straight above the origin, where a pixel's side is 1/8 m long."""
    view = Camera(
        eye=(0.0, 0.0, height), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0),
        fovy=frontal_fovy(height=SIZE, pixel=0.125, distance=height), width=SIZE, height=SIZE, near=0.01, far=50.0,
    )  # fmt: skip
    return Scene(camera=replace(view, **more), shapes=shapes, lights=lights)


def lamp(*position: float, flux: tuple[float, float, float] = (90.0, 70.0, 50.0)) -> PointLight:
    """Return a light."""
    x, y, z = position
    return PointLight(position=(x, y, z), flux=flux)


def level(x: float, y: float, z: float, *, side: float = 4.0, albedo: tuple[float, float, float] = GREY) -> Square:
    """Return a level square of the given side that faces upwards."""
    matrix = np.asarray(translation(x, y, z)) @ np.diag((side, side, 1.0, 1.0))
    return Square(albedo=albedo, to_world=tuple(map(tuple, matrix.tolist())))


def flipped(square: Square) -> Square:
    """Return the square turned over, so that it faces downwards."""
    matrix = np.asarray(square.to_world) @ np.diag((1.0, -1.0, -1.0, 1.0))
    return replace(square, to_world=tuple(map(tuple, matrix.tolist())))


def upright(x: float, *, side: float = 4.0) -> Square:
    """Return a wall at x that stands on z = 0 and faces -x."""
    columns = np.array(((0.0, 0.0, -1.0, x), (side, 0.0, 0.0, 0.0), (0.0, side, 0.0, side / 2), (0.0, 0.0, 0.0, 1.0)))
    return Square(albedo=GREY, to_world=tuple(map(tuple, columns.tolist())), two_sided=True)


def netted(*, width: int = WIDTH, height: int = HEIGHT) -> Scene:
    """Return a net with a vertex on each pixel's ray before a wall."""
    mesh = net(ORIGIN, width=width, height=height, thirds=1.0, across=(1.0, 0.0), upward=(0.0, 1.0), relief=1 / 128)
    return Scene(
        camera=camera(ORIGIN, width=width, height=height, far=32.0),
        shapes=(mesh, wall(ORIGIN, 6.0)),
        lights=(beside(ORIGIN, 1.0, 300.0),),
    )


def edge_on() -> Scene:
    """Return a cube whose upright edge is on the middle pixel's ray, one side lit more than the other."""
    half = float(np.sqrt(0.5))
    turned = ((half, -half, 0.0, 0.0), (half, half, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    view = Camera(
        eye=(0.0, -5.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), fovy=20.0, width=SIZE, height=SIZE,
        near=0.1, far=50.0,
    )  # fmt: skip
    return Scene(camera=view, shapes=(Cube(albedo=GREY, to_world=turned),), lights=(lamp(3.0, -5.0, 1.0),))


IMAGES = tuple(stage for stage in Stage if stage is not Stage.CAMERA)
