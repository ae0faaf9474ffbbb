"""What is seen of many shapes is what is seen of the nearest of them alone."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import GEOMETRY, Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

MOST = 12  # shapes


@LAWS.register("shapes_alone", stage=Stage.OBJECT, implicates=("HIT-9",), staged=True)
def shapes_alone(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Take all shapes but one away, each in turn: every pixel sees the one that it sees nearest alone.

    Proof: the nearest hit over all geometry is the least of each shape's nearest. Source: specification, HIT-9.
    """
    count = len(scene.shapes)
    if not 2 <= count <= MOST:
        return
    whole = ask(scene)
    if not all(stage in whole for stage in (Stage.OBJECT, Stage.DISTANCE)):
        return
    parts = [replace(scene, shapes=(shape,)) for shape in scene.shapes]
    alone = [ask(part) for part in parts]
    distances = np.stack([one[Stage.DISTANCE][..., 0] for one in alone])
    nearest = np.argmin(distances, axis=0)
    for stage in GEOMETRY[1:]:
        if stage in whole and all(stage in one for one in alone):
            images = np.stack([one[stage] for one in alone])
            if stage is Stage.OBJECT:
                numbers = np.arange(count)[:, np.newaxis, np.newaxis]
                images[..., 0] = np.where(images[..., 0] >= 0, numbers, -1)
            expected = np.take_along_axis(images, nearest[np.newaxis, ..., np.newaxis], axis=0)[0]
            yield Relation(
                stage=stage,
                expected=expected,
                measured=whole[stage],
                scene=parts[0],
                changed=scene,
                what="each shape alone",
            )
