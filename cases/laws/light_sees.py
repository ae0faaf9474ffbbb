"""A light sees what it lights."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import vector
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation
from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage

PIXELS = 3  # that are asked about, each by an image of its own
LEAST = 0.05  # cosine and share of the distance below which either answer would do


@LAWS.register("light_sees", stage=Stage.VISIBILITY, implicates=("LIT-1", "LIT-2", "LIT-3", "LIT-5"), staged=True)
def light_sees(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put the camera in the first light's place and look at a hit: it is seen there if, and only if, it is lit.

    Proof: the feeler and the line of sight are the same segment, and nothing but its ends tells them apart.
    Source: von Helmholtz, Handbuch der physiologischen Optik (1867), on reciprocity; specification, LIT-1.
    """
    answers = ask(scene)
    if not scene.lights or Stage.VISIBILITY not in answers or Stage.POSITION not in answers:
        return
    light = np.asarray(scene.lights[0].position)
    towards = light - answers[Stage.POSITION]
    r = np.linalg.norm(towards, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.sum(towards * answers[Stage.NORMAL], axis=-1) / r
    above = (answers[Stage.OBJECT][..., 0] >= 0) & (cosine > LEAST)
    for lit in (1.0, 0.0):
        rows, columns = np.nonzero(above & (answers[Stage.VISIBILITY][..., 0] == lit))
        for pick in range(min(PIXELS, len(rows))):
            row, column = (list_[pick * len(list_) // PIXELS] for list_ in (rows, columns))
            point = answers[Stage.POSITION][row, column]
            upward = np.eye(3)[int(np.argmin(np.abs(light - point)))]
            camera = Camera(
                eye=vector(light),
                target=vector(point),
                up=vector(upward),
                fovy=1.0,
                width=1,
                height=1,
                near=1e-3 * float(r[row, column]),
                far=1e3 * float(r[row, column]),
            )
            back = replace(scene, camera=camera, clip="none")
            distance = float(ask(back)[Stage.DISTANCE][0, 0, 0])
            # What is hit just before the point may be the point itself.
            if not lit and distance > (1 - LEAST) * r[row, column]:
                continue
            yield Relation(
                stage=Stage.VISIBILITY,
                expected=np.full((1, 1, 1), float(distance > (1 - 1e-3 * LEAST) * r[row, column])),
                measured=np.full((1, 1, 1), lit),
                scene=back,
                changed=scene,
                what=f"pixel ({column}, {row}) seen from the first light",
                conditions=Conditions(exact=True),
            )
