"""A closed form for a shadow's outline: inside dark, outside lit, the margin about the outline left alone."""

import numpy as np

from rayproof.cases.case import ShadowOutline
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.comparison.expectations import EXPECTATIONS, Finding


@EXPECTATIONS.register("ShadowOutline")
def shadow_outline(expectation: ShadowOutline, scene: Scene, answers: StageImages, slack: float) -> Finding:
    """Count the pixels on the wrong side of the outline; none may be."""
    seen = answers[Stage.OBJECT][..., 0] == expectation.shape
    offset = np.abs(answers[Stage.POSITION][..., :2] - np.asarray(expectation.center))
    if expectation.form == "square":
        beyond = offset.max(axis=-1) - expectation.size
    elif expectation.form == "disc":
        beyond = np.hypot(offset[..., 0], offset[..., 1]) - expectation.size
    else:
        raise ValueError(f"a shadow outline is a square or a disc, not {expectation.form!r}")
    margin = expectation.margin + slack * expectation.size
    lit = answers[Stage.VISIBILITY][..., expectation.light]
    inside, outside = seen & (beyond < -margin), seen & (beyond > margin)
    wrong = np.count_nonzero(inside & (lit != 0)) + np.count_nonzero(outside & (lit != 1))
    # Without pixels on both sides there is no outline to speak of.
    used = int(np.count_nonzero(inside | outside)) if np.any(inside) and np.any(outside) else 0
    return Finding(measured=float(wrong), expected=0.0, limit=0.0, used=used)
