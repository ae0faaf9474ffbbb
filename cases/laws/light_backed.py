"""What stands behind a light does not hide it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import BLACK, behind_the_eye, matrix, strong, vector, view, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Cube, PointLight, Scene, Square
from rayproof.cases.stages import Stage


@LAWS.register("light_backed", stage=Stage.VISIBILITY, implicates=("LIT-1",))
def light_backed(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a wall and a cube behind the eye and behind the only light, at 1.02 to 1.2 of the way: nothing changes.

    Proof: a feeler ends at the light, and the wall lies beyond, on the far side of a plane that neither eye nor light
    nor anything seen lies on. Source: specification, E10.
    """
    axes = view(scene.camera)
    place = behind_the_eye(scene, 0.2)
    alone = with_lights(scene, PointLight(position=vector(place), flux=strong(scene)))
    for share in (0.02, 0.1, 0.2):
        back = place - share * 1.2 * axes.distance * axes.forward
        pose = np.eye(4)
        pose[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * axes.distance
        pose[:3, 3] = back
        wall = Square(albedo=BLACK, to_world=matrix(pose), two_sided=True)
        pose[:3, 3] = back - 0.6 * axes.distance * axes.forward
        block = Cube(albedo=BLACK, to_world=matrix(pose))
        backed = replace(alone, shapes=(*alone.shapes, wall, block))
        yield from related(ask, alone, backed, what=f"a wall at {1 + share:g} of the way to the light")
