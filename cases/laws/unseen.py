"""What stands behind the eye and behind the light is neither seen nor in the way."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import lit_from_the_eye, matrix, view
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

COUNTS = (1, 9)  # of each kind: few, and more than renderers treat one by one
CORNERS = ((0.0, 0.0, 0.5), (0.5, 0.0, -0.5), (-0.5, 0.4, -0.5), (-0.5, -0.4, -0.5))
SIDES = ((0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2))
ALBEDO = (0.9, 0.9, 0.9)
TRIANGLE = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.0, 0.5, 0.0))


def crowd(scene: Scene, count: int) -> tuple[Shape, ...]:
    """Return `count` shapes of each kind, at most nine, all of them at least twice the near distance behind the eye."""
    axes = view(scene.camera)
    size = 0.2 * axes.distance
    shapes: list[Shape] = []
    for index in range(count):
        for row, kind in enumerate((Sphere, Cube, Square, Triangle, Mesh)):
            back = 2 * size + 2 * scene.camera.near + size * row
            across, upward = (index + 4) // 3 % 3 - 1, (index + 4) % 3 - 1  # the middle one first
            sideways = 1.5 * size * (across * axes.right + upward * axes.up)
            place = np.eye(4)
            place[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * size
            place[:3, 3] = axes.eye - back * axes.forward + sideways
            more = {
                Sphere: {"radius": 0.5},
                Triangle: {"vertices": TRIANGLE},
                Mesh: {"vertices": np.array(CORNERS), "faces": np.array(SIDES)},
            }
            shapes.append(kind(albedo=ALBEDO, to_world=matrix(place), **more.get(kind, {})))
    return tuple(shapes)


@LAWS.register("unseen", stage=Stage.OBJECT, implicates=("HIT-1", "HIT-2", "HIT-3", "HIT-6", "HIT-7", "HIT-9"))
def unseen(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put one shape of each kind, and nine, behind the eye, and the only light in front of it: nothing changes.

    Proof: what is seen and the light lie on the same side of the plane through the eye, and so does the segment between
    them; the crowd lies on the other. Source: specification, HIT-2 and E4.
    """
    lit = lit_from_the_eye(scene)
    for count in COUNTS:
        changed = replace(lit, shapes=(*lit.shapes, *crowd(scene, count)))
        yield from related(ask, lit, changed, what=f"{count} of each kind of shape behind the eye")
