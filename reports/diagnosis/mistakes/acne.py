"""Shadow acne, LIT-2 to LIT-5: which points of a surface shadow themselves, roundings decide, so no pixel is foretold.

It is told by how it looks: of points that one light lights, some are dark for no other reason, scattered among such as
are right. What shadows wrongly for another reason darkens whole regions, whose pixels have few right neighbours; what
dims or colours leaves some light.
"""

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.diagnosis import MISTAKES, Mistake, Way
from rayproof.reports.diagnosis.trial import Evidence, deviates

DARKENED = 0.98  # of the wrong pixels so many have no light left
FEW = 0.005  # of a case's pixels: so many may be wrong otherwise, since the same roundings move hits at grazing angles
SCATTERED = 0.8  # of these so many have a right pixel of the same shape beside them: of a region its rim alone has
LEAST = 30  # pixels of a case: of a smaller region nearly all is rim


def scattered(evidence: Evidence) -> bool | None:
    """Say whether a case's wrong pixels are dark ones scattered over lit surfaces; None where it says nothing.

    Cases of several lights say nothing, and roundings of a pattern, such as on a wall that the rays meet evenly.
    """
    stage = Stage.VISIBILITY if Stage.VISIBILITY in evidence.stages else Stage.RADIANCE
    if len(evidence.scene.lights) != 1 or stage not in evidence.stages:
        return None
    geometry = IMAGE_STAGES[: IMAGE_STAGES.index(Stage.VISIBILITY)]
    before = {one: evidence.ours[one] for one in evidence.stages if one in geometry}
    few = FEW * evidence.wrong.size
    if np.count_nonzero(deviates(evidence.right, before) & ~evidence.right.edge) > few:
        return False
    lit = np.any(evidence.right.answers[stage] > 0, axis=-1) & ~evidence.right.edge
    dark = evidence.wrong & lit & np.all(evidence.ours[stage] == 0, axis=-1)
    others = np.count_nonzero(evidence.wrong) - np.count_nonzero(dark)
    if others > max(few, (1 - DARKENED) * np.count_nonzero(evidence.wrong)):
        return False
    if np.count_nonzero(dark) < LEAST:
        return None
    beside = dark & _beside(lit & ~evidence.wrong, evidence.right.answers[Stage.OBJECT][..., 0])
    return bool(np.count_nonzero(beside) >= SCATTERED * np.count_nonzero(dark)) or None


def _beside(good: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) with a good one of the same shape above, below, to the left or to the right."""
    found = np.zeros_like(good)
    for one, other in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        same = objects[one] == objects[other]
        found[one] |= same & good[other]
        found[other] |= same & good[one]
    return found


MISTAKES.register("acne")(
    Mistake(
        says="lets surfaces shadow themselves, so that scattered points of them are dark (shadow acne)",
        items=("LIT-2", "LIT-3", "LIT-4", "LIT-5"),
        ways=(Way(formulas={"feeler": "fault_bare"}),),
        seen=scattered,
    )
)
