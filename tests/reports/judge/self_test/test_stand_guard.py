"""The sentinels pass an honest judge and stop a broken one."""

import numpy as np
import pytest

from rayproof.reports.judge import against_oracle
from rayproof.reports.judge.limit_sentinels import BrokenJudgeError
from rayproof.reports.judge.nearby.explaining import Asking
from rayproof.reports.judge.sentinels import stand_guard
from tests.reports.judge.scenes import ORACLE


def test_an_honest_judge_gets_every_sentinel_right():
    assert stand_guard(ORACLE) > 40


def test_limits_a_thousand_times_too_wide_are_noticed(monkeypatch):
    honest = against_oracle.ratios

    def lenient(stage, ours, theirs, limit):
        return honest(stage, ours, theirs, 1000 * limit)

    monkeypatch.setattr(against_oracle, "ratios", lenient)

    with pytest.raises(BrokenJudgeError):
        stand_guard(ORACLE)


def test_nearby_problems_that_explain_everything_are_noticed(monkeypatch):
    def swallow(asking, pixels, cloud, found, kind, declared=None):
        for stage, mask in asking._left.items():
            getattr(found[stage], kind)[...] |= mask
            mask[...] = np.zeros_like(mask)

    monkeypatch.setattr(Asking, "_judge", swallow)

    with pytest.raises(BrokenJudgeError):
        stand_guard(ORACLE)
