"""Where the clip interval holds nothing, nothing is seen."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import world_triangles
from rayproof.cases.relations import Ask, Conditions, Relation
from rayproof.cases.scene import Mesh, Plane, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage

MARGIN = 1.5  # times the farthest distance that a shape can have


def farthest(shape: Shape, eye: np.ndarray) -> float:
    """Return a bound on the distance [m] of a bounded shape's points from the eye."""
    if isinstance(shape, Triangle | Mesh):
        return float(np.linalg.norm(world_triangles(shape).astype(np.float64) - eye, axis=-1).max())
    pose = np.asarray(shape.to_world)
    center, radius = (np.asarray(shape.center), shape.radius) if isinstance(shape, Sphere) else (np.zeros(3), 0.75**0.5)
    place = pose[:3, :3] @ center + pose[:3, 3]
    return float(np.linalg.norm(place - eye) + radius * np.linalg.norm(pose[:3, :3], ord=2))


@LAWS.register("clip_beyond", stage=Stage.OBJECT, implicates=("HIT-2",))
def clip_beyond(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move near and far beyond everything there is, as planes and as shells: the image is black.

    Proof: every hit lies nearer than the farthest point of any shape. Source: specification, HIT-2.
    """
    if any(isinstance(shape, Plane) for shape in scene.shapes) or not scene.shapes:
        return
    eye = np.asarray(scene.camera.eye)
    beyond = MARGIN * max(farthest(shape, eye) for shape in scene.shapes)
    for clip in ("depth", "shell"):
        changed = with_camera(replace(scene, clip=clip), near=beyond, far=4 * beyond)
        answers = ask(changed)
        for stage, nothing in ((Stage.OBJECT, -1.0), (Stage.DISTANCE, np.inf), (Stage.RADIANCE, 0.0)):
            if stage in answers:
                yield Relation(
                    stage=stage,
                    expected=np.full(answers[stage].shape, nothing),
                    measured=answers[stage],
                    scene=changed,
                    changed=changed,
                    what=f"clipped ({clip}) from {beyond:g} m on, beyond everything",
                    conditions=Conditions(exact=True),
                )
