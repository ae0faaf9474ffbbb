"""The camera stage: every entry of every part counts, also where its limit is 0."""

import numpy as np
import pytest

from rayproof.cases.scene import Camera
from rayproof.reference.analytic.camera import camera_answer
from rayproof.reports.judge import camera_check
from rayproof.reports.judge.forward.limits import Roundoff

# At the origin the eye's own error is 0 and so is the limit of what it moves.
AT_ORIGIN = Camera(
    eye=(0.0, 0.0, 0.0), target=(0.3, 1.0, 0.2), up=(0.0, 0.0, 1.0), fovy=40.0, width=4, height=3, near=0.1, far=50.0
)
SINGLE = Roundoff("float32")


def test_an_equal_camera_at_the_origin_uses_nothing_of_its_limits():
    answer = camera_answer(AT_ORIGIN)

    assert camera_check.compared(answer, answer, AT_ORIGIN, SINGLE).ratio == 0


@pytest.mark.parametrize("spoil", [np.nan, np.inf, "off"], ids=str)
def test_no_entry_of_any_part_is_overlooked(spoil):
    answer = camera_answer(AT_ORIGIN)
    overlooked = []
    for part, value in answer.items():
        limit = SINGLE(camera_check.COUNT) * np.broadcast_to(camera_check.scales(AT_ORIGIN)[part], value.shape)
        for entry in np.ndindex(value.shape):
            wrong = value.copy()
            wrong[entry] += max(2 * limit[entry], 1e-300) if spoil == "off" else spoil
            ratio = camera_check.compared(answer | {part: wrong}, answer, AT_ORIGIN, SINGLE).ratio
            if not ratio > 1:
                overlooked.append((part, entry))

    assert not overlooked


def test_axes_mirrored_and_stretched_at_the_origin_fail():
    answer = camera_answer(AT_ORIGIN)
    view = answer["view"] * np.array([[-1.0], [3.0], [1.0], [1.0]])
    spoilt = {"view": view, "view_inverse": answer["view_inverse"] * 1.5}

    for part, wrong in spoilt.items():
        assert camera_check.compared(answer | {part: wrong}, answer, AT_ORIGIN, SINGLE).ratio > 1, part
        assert not camera_check.inconsistency(answer | {part: wrong}, AT_ORIGIN, SINGLE) <= 1, part
