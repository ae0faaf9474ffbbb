"""A light in a closed box gives no light outside of it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cases.laws import LAWS
from cases.relations import LIGHT, Ask, Conditions, Relation, matrix, related, vector, view, with_lights
from cases.scene import Cube, PointLight, Scene, Shape, Sphere
from cases.stages import Stage

BLACK = (0.0, 0.0, 0.0)


def behind_the_eye(scene: Scene, share: float) -> np.ndarray:
    """Return the place [m] behind the eye at a share of the target's distance."""
    axes = view(scene.camera)
    return axes.eye - share * axes.distance * axes.forward


def strong(scene: Scene) -> tuple[float, float, float]:
    """Return a flux [W] that lights the target well from about the eye."""
    flux = 50.0 * view(scene.camera).distance ** 2
    return flux, 1.1 * flux, 0.9 * flux


def around(scene: Scene, place: np.ndarray, size: float, kind: type[Shape]) -> Shape:
    """Return a black, closed shape of half-width `size` [m] about a place, turned as the camera is."""
    axes = view(scene.camera)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * (size if kind is Sphere else 2 * size)
    pose[:3, 3] = place
    return kind(albedo=BLACK, to_world=matrix(pose))


def switched_on(scene: Scene, place: np.ndarray, *walls: Shape) -> tuple[Scene, Scene]:
    """Return the scene with walls, and the same with a strong light at `place` as well."""
    dark = replace(scene, shapes=(*scene.shapes, *walls))
    return dark, with_lights(dark, *dark.lights, PointLight(position=vector(place), flux=strong(scene)))


@LAWS.register("light_hidden", stage=Stage.VISIBILITY, implicates=("LIT-1", "HIT-1", "HIT-3", "HIT-9"))
def light_hidden(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch on a light in a small closed cube, and in a sphere, behind the eye: nothing changes.

    Proof: every segment that leads to the light crosses a wall. Walls are there in both images, so that what else they
    hide cancels. Source: specification, LIT-1 and E10.
    """
    place = behind_the_eye(scene, 0.25)
    for kind in (Cube, Sphere):
        wall = around(scene, place, 0.02 * view(scene.camera).distance, kind)
        dark, lit = switched_on(scene, place, wall)
        what = f"a light switched on inside a closed {kind.__name__.lower()}"
        yield from related(ask, dark, lit, what=what, stages=LIGHT, conditions=Conditions(exact=True))
