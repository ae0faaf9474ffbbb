"""A point's radiance does not depend on who looks at it."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import vector, view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

PIXELS = 4
SIDE = 3  # px: the point in the middle, its neighbours about it
KEPT = (Stage.OBJECT, Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@LAWS.register("view_free", stage=Stage.RADIANCE, implicates=("RAD-4", "RAD-5", "LIT-1", "NRM-3"), staged=True)
def view_free(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look at a hit from an eye beside the first one: its normal, its light and its radiance are the same.

    Proof: a diffuse surface is equally bright from everywhere on the same side (Lambert's law), and nothing between
    point and light moved. A point that the other eye does not see is left out. Source: Lambert, Photometria (1760).
    """
    answers = ask(scene)
    if not all(stage in answers for stage in (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION)):
        return
    axes, camera = view(scene.camera), scene.camera
    rows, columns = np.nonzero(answers[Stage.OBJECT][..., 0] >= 0)
    beside = axes.eye + 0.02 * axes.distance * (axes.right - 0.6 * axes.up)
    for pick in range(min(PIXELS, len(rows))):
        row, column = (list_[(2 * pick + 1) * len(list_) // (2 * PIXELS)] for list_ in (rows, columns))
        point = answers[Stage.POSITION][row, column]
        fovy = camera.fovy * SIDE / camera.height
        looking = {"eye": vector(beside), "target": vector(point), "fovy": fovy, "width": SIDE, "height": SIDE}
        other = with_camera(scene, **looking)
        there = ask(other)
        middle = SIDE // 2
        found = there[Stage.POSITION][middle, middle]
        if np.linalg.norm(found - point) > 1e-4 * np.linalg.norm(point - beside):
            continue
        for stage in KEPT:
            if stage in answers and stage in there:
                expected = there[stage].copy()
                expected[middle, middle] = answers[stage][row, column]
                centre = np.zeros((SIDE, SIDE), dtype=bool)
                centre[middle, middle] = True
                yield Relation(
                    stage=stage,
                    expected=expected,
                    measured=there[stage],
                    scene=other,
                    changed=scene,
                    what=f"pixel ({column}, {row}) seen from beside",
                    examined=centre,
                )
