"""Random scenes whose fields are drawn over their whole ranges: `up` of any length, images of any shape, and so on.

The scene is the one of the same seed and number in `cases.random`, with its features, and keeps what it shows. What
changes is how that is written down, the camera's angle and image, and how bright things are. A renderer that reads each
field by its meaning does not care; a mutant is equivalent only if it passes these.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import compose, scaling
from rayproof.cases.random import EDITION, FAMILY, MOST_EDGE, random_scene
from rayproof.cases.random.draft import upward
from rayproof.cases.random.draws import Draws
from rayproof.cases.scene import Camera, Matrix, Mesh, PointLight, Rgb, Scene, Shape, Sphere, Triangle, Vector

STREAM = 1  # beside the one of the scene itself, which stays what it is
MOST_PIXELS = 600
LONGEST = 96  # px


@lru_cache(maxsize=64)
def wide_case(seed: int, number: int) -> Case:
    """Return the case of a random scene with every field drawn over its range."""
    scene = widened(random_scene(seed, number).scene, Draws(EDITION, seed, number, STREAM))
    return Case(
        name=f"{FAMILY}_wide/{seed}/{number}",
        scene=scene,
        stresses="Drawn at random, every field over its whole range.",
        covers=covering(scene),
        least_interior=0,
        most_edge=MOST_EDGE,
        tuned=False,
    )


def widened(scene: Scene, draws: Draws) -> Scene:
    """Return a scene with the same shapes and lights in the same places, everything else drawn anew."""
    return Scene(
        camera=_camera(scene.camera, draws),
        shapes=tuple(_shape(shape, draws) for shape in scene.shapes),
        lights=tuple(_light(light, draws) for light in scene.lights),
        shading=scene.shading,
        clip=scene.clip,
    )


def _camera(camera: Camera, draws: Draws) -> Camera:
    width = int(draws.logarithmic(1, LONGEST + 1))
    height = min(int(draws.logarithmic(1, LONGEST + 1)), max(1, MOST_PIXELS // width))
    length = draws.logarithmic(1e-3, 1e3)
    up = upward(camera.eye, camera.target, draws.direction())
    # The target may lie anywhere on the central ray, from close to the eye to far behind what is seen.
    share = draws.logarithmic(0.05, 20)
    eye, ahead = np.asarray(camera.eye), np.subtract(camera.target, camera.eye)
    return replace(
        camera,
        target=_vector(eye + share * ahead) if draws.chance(0.5) else camera.target,
        up=_vector(length * np.asarray(up)),
        # A telescope keeps its angle, for beside it nothing may be seen.
        fovy=draws.uniform(5, 170) if camera.fovy > 1 and draws.chance(0.5) else camera.fovy,
        width=width,
        height=height,
    )


def _shape(shape: Shape, draws: Draws) -> Shape:
    """Return the shape in other units of its object space, with albedos that may exceed 1."""
    shape = replace(shape, albedo=_colour(shape.albedo, draws.vector(0, 3)))
    unit = draws.logarithmic(1e-3, 1e3)
    to_world: Matrix = compose(shape.to_world, scaling(1 / unit, 1 / unit, 1 / unit))
    if isinstance(shape, Sphere):
        return replace(
            shape, center=_vector(unit * np.asarray(shape.center)), radius=unit * shape.radius, to_world=to_world
        )
    if isinstance(shape, Triangle):
        first, second, third = (_vector(unit * np.asarray(corner)) for corner in shape.vertices)
        return replace(shape, vertices=(first, second, third), to_world=to_world)
    if isinstance(shape, Mesh):
        return replace(shape, vertices=shape.vertices.astype(np.float64) * unit, to_world=to_world)
    return shape


def _light(light: PointLight, draws: Draws) -> PointLight:
    factor = draws.logarithmic(1e-4, 1e4)
    return replace(light, flux=_colour(light.flux, (factor, factor, factor)))


def _colour(colour: Rgb, factors: Vector) -> Rgb:
    red, green, blue = (part * factor for part, factor in zip(colour, factors, strict=True))
    return red, green, blue


def _vector(array: np.ndarray) -> Vector:
    x, y, z = (float(part) for part in array)
    return x, y, z
