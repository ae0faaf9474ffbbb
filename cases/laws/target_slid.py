"""How far away the target is does not matter."""

from collections.abc import Iterator

from rayproof.cases.changes import vector, view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("target_slid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4", "CAM-5"))
def target_slid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Slide the target along the line of sight, nearer and farther: nothing changes.

    Proof: any t > 0 of ref = eye + t F gives the same ray. Source: specification, CAM-4.
    """
    axes = view(scene.camera)
    for share in (0.6, 1.7):
        target = vector(axes.eye + share * axes.distance * axes.forward)
        what = f"the target at {share:g} of its distance"
        yield from related(ask, scene, with_camera(scene, target=target), what=what)
