"""A plane just before a hit leaves it, one just behind it takes it away."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("clip_measured", stage=Stage.OBJECT, implicates=("HIT-2", "CAM-2"), staged=True)
def clip_measured(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put near and far where the renderer's own rays find the median surface: hits outside are clipped, others stay.

    Proof: the plane's depth is t dot(d, F), and the shell's distance t, both of the renderer's own hits; what the
    first hit leaves behind when it is clipped is not asked about. Source: specification, HIT-2.
    """
    free = replace(scene, clip="none")
    seen = ask(free)
    if not all(stage in seen for stage in (Stage.RAY, Stage.OBJECT, Stage.DISTANCE)):
        return
    distance = seen[Stage.DISTANCE][..., 0]
    hit = np.isfinite(distance)
    # A ray in a surface's own plane meets it anywhere or nowhere.
    if Stage.NORMAL in seen:
        hit &= np.abs(np.sum(seen[Stage.NORMAL] * seen[Stage.RAY], axis=-1)) > 1e-3
    if not hit.any():
        return
    along = np.where(hit, distance, 0.0)
    depth = along * (seen[Stage.RAY] @ view(scene.camera).forward)
    for clip, measure in (("depth", depth), ("shell", along)):
        middle = float(np.median(measure[hit])) * 1.0137
        cut = with_camera(replace(scene, clip=clip), near=1e-3 * middle, far=middle)
        first = ask(cut)[Stage.OBJECT]
        sure = hit & (np.abs(measure - middle) > 1e-4 * middle) & (measure > 2e-3 * middle)
        yield Relation(
            stage=Stage.OBJECT,
            expected=np.where((measure < middle)[..., np.newaxis], seen[Stage.OBJECT], -1.0),
            measured=first,
            scene=free,
            changed=cut,
            what=f"the far {clip} at {middle:g} m, the median of what is seen",
            examined=sure,
        )
        beyond = with_camera(replace(scene, clip=clip), near=middle, far=1e6 * middle)
        second = ask(beyond)
        kept = sure & (measure > middle)
        yield Relation(
            stage=Stage.OBJECT,
            expected=seen[Stage.OBJECT],
            measured=second[Stage.OBJECT],
            scene=free,
            changed=beyond,
            what=f"the near {clip} at {middle:g} m, the median of what is seen",
            examined=kept,
        )
