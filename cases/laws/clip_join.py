"""What is seen between two planes is what is seen before a third between them, or else behind it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import GEOMETRY, Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("clip_join", stage=Stage.OBJECT, implicates=("HIT-2",))
def clip_join(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Clip from near to a middle distance and from there to far: each ray sees the first part's hit, else the second's.

    Proof: the intervals join, and the smallest of their two smallest numbers is the smallest of all. Looked at from
    radiance alone, what is black in the first part may be hit there or not, and either is right.
    Source: specification, HIT-2.
    """
    if scene.clip == "none":
        return
    camera, axes = scene.camera, view(scene.camera)
    for clip in ("depth", "shell"):
        joint = replace(scene, clip=clip)
        middle = axes.distance * 0.9731  # where no scene has a surface on purpose
        if not camera.near < middle < camera.far:
            continue
        front, back = with_camera(joint, far=middle), with_camera(joint, near=middle)
        whole, first, second = ask(joint), ask(front), ask(back)
        for stage in (*GEOMETRY[1:], Stage.RADIANCE):
            if not all(stage in one for one in (whole, first, second)):
                continue
            if Stage.OBJECT in first:
                hit = first[Stage.OBJECT][..., :1] >= 0
            else:
                hit = (first[stage] > 0).any(axis=-1, keepdims=True) | (whole[stage] == 0).all(axis=-1, keepdims=True)
            yield Relation(
                stage=stage,
                expected=np.where(hit, first[stage], second[stage]),
                measured=whole[stage],
                scene=front,
                changed=joint,
                what=f"clipped ({clip}) before and behind {middle:g} m",
            )
