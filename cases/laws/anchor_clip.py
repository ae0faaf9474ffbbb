"""A floor straight below, cut by near and far planes, and by spheres about the eye."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Camera, PointLight, Scene, Square
from rayproof.cases.stages import Stage

DEPTH = 2.0  # m
CAMERA = Camera(
    eye=(0.0, 0.0, DEPTH),
    target=(0.0, 0.0, 0.0),
    up=(0.0, 1.0, 0.0),
    fovy=70.0,
    width=15,
    height=11,
    near=0.1,
    far=10.0,
)
SHARES = (0.9, 0.999, 1.001, 1.15)  # of the floor's depth; no pixel's centre is as far away


@LAWS.register("anchor_clip", stage=Stage.OBJECT, implicates=("HIT-2",), anchor=True, own=True)
def anchor_clip(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look straight down at a floor and clip it: planes cut all of it or nothing, spheres about the eye a disc.

    Proof: its depth is the same for all rays, and the distance depth / cos with tan = tan(alpha) (aspect sx, sy).
    Source: specification, HIT-2 and E2.
    """
    del scene
    pose = ((90.0, 0.0, 0.0, 0.0), (0.0, 90.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    light = PointLight(position=CAMERA.eye, flux=(500.0, 400.0, 300.0))
    whole = Scene(camera=CAMERA, shapes=(Square(albedo=(0.5, 0.6, 0.7), to_world=pose),), lights=(light,))
    tall = np.tan(CAMERA.alpha)
    across = (2 * (np.arange(CAMERA.width) + 0.5) / CAMERA.width - 1) * tall * CAMERA.aspect
    up = (1 - 2 * (np.arange(CAMERA.height) + 0.5) / CAMERA.height) * tall
    x, y = np.meshgrid(across, up)
    measures = {"depth": np.full(x.shape, DEPTH), "shell": DEPTH * np.sqrt(1 + x * x + y * y)}
    free = ask(replace(whole, clip="none"))
    for clip, measure in measures.items():
        for share in SHARES:
            plane = share * DEPTH
            for side, cut, seen in (
                ("near", {"near": plane, "far": 50 * DEPTH}, measure > plane),
                ("far", {"near": 0.01 * DEPTH, "far": plane}, measure < plane),
            ):
                changed = with_camera(replace(whole, clip=clip), **cut)
                answers = ask(changed)
                for stage, nothing in ((Stage.OBJECT, -1.0), (Stage.DISTANCE, np.inf), (Stage.RADIANCE, 0.0)):
                    if stage in answers and stage in free:
                        yield Relation(
                            stage=stage,
                            expected=np.where(seen[..., np.newaxis], free[stage], nothing),
                            measured=answers[stage],
                            scene=whole,
                            changed=changed,
                            what=f"{side} ({clip}) at {share:g} of the floor's depth",
                        )
