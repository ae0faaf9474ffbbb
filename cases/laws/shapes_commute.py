"""Shapes may come in any order."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cases.laws import LAWS
from cases.relations import Ask, Relation, related
from cases.scene import Cube, Mesh, Scene, Shape, Sphere, Triangle
from cases.stages import Stage

CLOSE = 1e-5  # of plane equations: far more than rounding leaves between two that are one


def planes(shape: Shape) -> np.ndarray:
    """Return the planes (n, 4) that hold a shape's flat sides: unit normals, turned to one side, and offsets [m]."""
    if isinstance(shape, Sphere | Mesh | Triangle):
        return np.zeros((0, 4))
    local = np.array([(0.0, 0.0, 1.0, 0.0)])
    if isinstance(shape, Cube):
        local = np.array([(*axis, half) for axis in np.eye(3) for half in (-0.5, 0.5)])
    found = local @ np.linalg.inv(np.asarray(shape.to_world))
    found /= np.linalg.norm(found[:, :3], axis=1, keepdims=True)
    first = np.take_along_axis(found, np.argmax(np.abs(found[:, :3]) > 0.5, axis=1)[:, np.newaxis], axis=1)
    return found * np.sign(first)


def coincide(scene: Scene) -> bool:
    """Say whether flat sides of two shapes lie in one plane, where either may be the nearest."""
    sides = [planes(shape) for shape in scene.shapes]
    return any(
        np.abs(one[:, np.newaxis] - other[np.newaxis]).max(axis=-1).min(initial=1.0) < CLOSE
        for index, one in enumerate(sides)
        for other in sides[:index]
    )


@LAWS.register("shapes_commute", stage=Stage.OBJECT, implicates=("HIT-9", "LIT-1"))
def shapes_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List the shapes backwards: object indices come backwards, and nothing else changes.

    Proof: the nearest hit is the least of a set, and so is whether any shape blocks a feeler.
    Where two shapes' sides
    lie in one plane there is no nearest, and the law says nothing. Source: specification, HIT-9.
    """
    count = len(scene.shapes)
    if count < 2 or coincide(scene):
        return

    def renamed(image: np.ndarray) -> np.ndarray:
        return np.stack([np.where(image[..., 0] >= 0, count - 1 - image[..., 0], -1.0), image[..., 1]], axis=-1)

    changed = replace(scene, shapes=scene.shapes[::-1])
    yield from related(ask, scene, changed, what="the shapes listed backwards", before={Stage.OBJECT: renamed})
