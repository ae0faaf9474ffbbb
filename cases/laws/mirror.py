"""A mirrored world is seen mirrored."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import carried_by, has_triangles, moved
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import scaling
from rayproof.cases.relations import Ask, Conditions, Relation, everywhere, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

MIRROR = scaling(-1, 1, 1)


@LAWS.register("mirror", stage=Stage.NORMAL, implicates=("CAM-1", "CAM-3", "XF-1", "NRM-3", "HIT-5", "HIT-6"))
def mirror(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Mirror everything in x = 0: the image is mirrored left to right, and normals still point outward.

    Proof: right = forward x up changes its sign under a mirror, dot products do not, and the world normal is the
    inverse transpose times the object normal also under mirrors. Source: specification, conventions and NRM-3.
    """

    def flipped(image: np.ndarray) -> np.ndarray:
        return image[:, ::-1]

    carried = carried_by(MIRROR)
    before = everywhere(flipped) | {
        stage: lambda image, change=change: flipped(change(image)) for stage, change in carried.items()
    }
    conditions = Conditions(rebaked=has_triangles(scene))
    changed = moved(scene, MIRROR)
    yield from related(ask, scene, changed, what="everything mirrored in x = 0", before=before, conditions=conditions)
