"""Box-filtered radiance is a question of its own: who gives no answer to it, or a misshapen one, is heard on others."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.limit_sentinels import FLOOR, MIDDLE
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import CASE, ORACLE, SCENE, candidate, rounded, truth, witness

SAMPLES = 2
MANY = replace(CASE, samples=SAMPLES)


@cache
def fine() -> dict:
    """Return the oracle's answers at the resolution of the samples."""
    scene = finer(SCENE, SAMPLES)
    return ORACLE.render(scene, stages_of(scene))


def judged(*, theirs: float = 1.0, ours: Any = None, means: dict[str, Any] | None = None) -> Judged:
    """Judge a faultless renderer before the oracle and a third whose radiance is `theirs` times the right one.

    `means` are other box-filtered images than the right one, by name; `ours` is the renderer's own.
    """
    mean = box_mean(fine()[Stage.RADIANCE], SAMPLES)
    given = dict.fromkeys(("analytic", "third"), mean) | (means or {})
    subject = replace(candidate(rounded(truth())), fine=rounded(fine()), mean=ours)
    third = truth() | {Stage.RADIANCE: truth()[Stage.RADIANCE] * theirs}
    witnesses = [witness(truth(), mean=given["analytic"]), witness(third, name="third", mean=given["third"])]

    found = judge_case(MANY, [subject], witnesses, ORACLE, {})

    asked = [(check.configuration, check.reference, check.stage) for check in found.checks]
    assert len(set(asked)) == len(asked) == found.planned
    return found


def outcomes(found: Judged) -> dict[tuple[str, str], Outcome]:
    """Return what became of radiance, by configuration and reference."""
    return {(c.configuration, c.reference): c.outcome for c in found.checks if c.stage is Stage.RADIANCE}


def test_the_same_means_pass():
    assert judged().outcome is Outcome.PASS


def test_who_gave_no_mean_keeps_its_word_on_radiance():
    found = outcomes(judged(theirs=1.01, means={"analytic": None}))

    assert found == {
        ("float32", "analytic"): Outcome.PASS,
        ("float32", "third"): Outcome.REFERENCE_SUSPECT,
        ("float32 x4", "analytic"): Outcome.ERROR,
        ("float32 x4", "third"): Outcome.PASS,
    }


@pytest.mark.parametrize("mean", [np.zeros((60, 80, 3)), np.zeros((30, 40, 2))], ids=["finer", "a channel less"])
def test_a_misshapen_mean_is_its_makers_fault(mean):
    theirs, ours = judged(means={"third": mean}), judged(ours=mean)

    assert (theirs.outcome, theirs.stage) == (Outcome.REFERENCE_SUSPECT, Stage.RADIANCE)
    assert "third's mean" in theirs.reason
    assert (ours.outcome, ours.stage) == (Outcome.FAIL, Stage.RADIANCE)
    assert "shape" in ours.reason


@pytest.mark.parametrize(("share", "outcome"), [(0.8, Outcome.PASS), (1.25, Outcome.FAIL)])
def test_a_mean_is_held_to_the_mean_of_its_rays_limits(share: float, outcome: Outcome):
    """At a pixel whose limit is known by hand; that of the rays beside its centre is nearly the same.

    Averaging n^2 numbers rounds n^2 - 1 times at worst; one more is counted.
    """
    samples = 3
    (pin,) = (pin for pin in FLOOR.pins if pin.stage is Stage.RADIANCE)
    scene = FLOOR.scene
    answers, fine = (ORACLE.render(each, stages_of(scene)) for each in (scene, finer(scene, samples)))
    right = box_mean(fine[Stage.RADIANCE], samples)
    limit = pin.end_to_end[0] * sum(UNIT_ROUNDOFF.values())
    limit += samples**2 * UNIT_ROUNDOFF["float32"] * right[MIDDLE][0]
    mean = right.copy()
    mean[MIDDLE][0] += share * limit
    subject = replace(candidate(rounded(answers)), fine=rounded(fine), mean=mean)

    found = judge_case(replace(FLOOR.case, samples=samples), [subject], [witness(answers, mean=right)], ORACLE, {})

    (check,) = (check for check in found.checks if check.configuration == "float32 x9")
    assert check.outcome is outcome, check.reason
