"""Moving everything at once moves nothing in the image."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import carried_by, has_triangles, moved
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, rotation, translation
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

MOTION = compose(translation(0.4, -0.3, 0.2), rotation((0.3, -0.5, 0.8), 77.0))


@LAWS.register("rigid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4", "XF-1", "XF-2", "NRM-3"))
def rigid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn and move camera, shapes and lights together: points and directions move along, radiance stays.

    Proof: every formula of the specification is made of dot products of differences of points, which a rigid motion
    keeps. Source: Weyl, Symmetry (1952); specification, CAM-1 and XF-1.
    """
    changed = moved(scene, MOTION)
    conditions = Conditions(rebaked=has_triangles(scene))
    yield from related(
        ask, scene, changed, what="everything turned and moved", before=carried_by(MOTION), conditions=conditions
    )
    # The same two images the other way round: what is too much in one of them may pass for an edge in the other.
    back = carried_by(np.linalg.inv(np.asarray(MOTION)))
    yield from related(ask, changed, scene, what="everything moved and turned back", before=back, conditions=conditions)
