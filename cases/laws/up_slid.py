"""Which way is up matters only across the line of sight."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import vector, view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("up_slid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4"))
def up_slid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Lengthen `up` and slide it along the line of sight: nothing changes.

    Proof: right = forward x up, normalised, does not see what is added along forward, nor up's length.
    Source: specification, CAM-1.
    """
    axes = view(scene.camera)
    up = np.asarray(scene.camera.up)
    for along, length in ((0.7, 1.0), (-0.4, 2.5)):
        slid = length * (up + along * np.linalg.norm(up) * axes.forward)
        changed = with_camera(scene, up=vector(slid))
        what = f"up times {length:g}, slid by {along:g} along the line of sight"
        yield from related(ask, scene, changed, what=what, conditions=Conditions(factor=2.0))
