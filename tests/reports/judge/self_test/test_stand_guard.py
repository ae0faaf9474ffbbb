"""The sentinels pass an honest judge and stop a broken one."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.reports.judge import scene_truth, stage_measuring
from rayproof.reports.judge.limit_sentinels import BrokenJudgeError
from rayproof.reports.judge.pixel_classes import classify
from rayproof.reports.judge.sentinels import stand_guard
from tests.reports.judge.scenes import ORACLE


def test_an_honest_judge_gets_every_sentinel_right():
    assert stand_guard(ORACLE) > 40


def test_limits_a_thousand_times_too_wide_are_noticed(monkeypatch):
    honest = stage_measuring.ratios

    def lenient(stage, ours, theirs, limit):
        return honest(stage, ours, theirs, 1000 * limit)

    monkeypatch.setattr(stage_measuring, "ratios", lenient)

    with pytest.raises(BrokenJudgeError):
        stand_guard(ORACLE)


def test_an_edge_class_that_swallows_everything_is_noticed(monkeypatch):
    def swallow(*arguments, **named):
        classes = classify(*arguments, **named)
        return replace(classes, outline=np.ones_like(classes.outline))

    monkeypatch.setattr(scene_truth, "classify", swallow)

    with pytest.raises(BrokenJudgeError):
        stand_guard(ORACLE)
