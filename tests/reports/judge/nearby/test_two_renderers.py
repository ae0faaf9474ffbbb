"""Two renderers agree if they differ by no more than both limits, or if neither is wrong; promises bind the tracer."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.judge.sentinels import BORDER, EDGE_CASE, SIDE, edge_scene
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import ORACLE, against, candidate, put, rounded, truth_of_scene, witness

SCENE = EDGE_CASE.scene
SQUARE, PLANE = (rounded(ORACLE.render(edge_scene(SIDE * part), stages_of(SCENE))) for part in (1 + 1e-9, 1 - 1e-9))


def pair(one: dict, other: dict) -> RendererPair:
    """Return two float32 renderers."""
    return RendererPair(against(SCENE, one, name="one"), against(SCENE, other, name="second"))


@pytest.mark.parametrize("stage", [Stage.OBJECT, Stage.DISTANCE, Stage.RADIANCE])
def test_who_shows_one_side_of_an_edge_agrees_with_who_shows_the_other(stage):
    both = pair(SQUARE, PLANE)

    assert not np.allclose(SQUARE[stage][BORDER], PLANE[stage][BORDER])
    assert both.pixels(stage).kinds[BORDER] == Kind.ROUNDING
    assert pair(PLANE, SQUARE).pixels(stage).kinds[BORDER] == Kind.ROUNDING


def test_who_is_wrong_disagrees_with_who_is_right_and_with_nobody_who_says_the_same():
    wrong = SQUARE | {Stage.DISTANCE: put(SQUARE[Stage.DISTANCE], BORDER, 4.4)}

    assert pair(wrong, SQUARE).pixels(Stage.DISTANCE).kinds[BORDER] == Kind.WRONG
    assert pair(PLANE, wrong).pixels(Stage.DISTANCE).kinds[BORDER] == Kind.WRONG
    assert pair(wrong, dict(wrong)).pixels(Stage.DISTANCE).kinds[BORDER] in (Kind.STRICT, Kind.WIDE)


@pytest.mark.parametrize(
    ("items", "tuned", "outcome"),
    [
        (frozenset({"CAM-4"}), True, Outcome.ERROR),
        (frozenset({"CAM-4"}), False, Outcome.UNDECIDED),
        (ITEMS_OF_OTHERS, True, Outcome.UNDECIDED),
    ],
    ids=["the-tracer", "in-a-users-scene", "another-renderer"],
)
@pytest.mark.parametrize("most", [28 / 256, 27 / 256])
def test_a_cases_promise_binds_the_tracer_and_leaves_others_undecided(items, tuned, outcome, most):
    # The border of the square meets the centres of 28 pixels, and here each shows what the oracle does not.
    truth = truth_of_scene(SCENE).truth
    shown = [ORACLE.render(edge_scene(SIDE * (1 + part)), stages_of(SCENE)) for part in (1e-9, -1e-9)]
    objects = [image[Stage.OBJECT] for image in shown]
    other = shown[int(np.array_equal(objects[0], truth[Stage.OBJECT]))]
    assert np.count_nonzero((other[Stage.OBJECT] != truth[Stage.OBJECT]).any(axis=-1)) == 28
    subject = replace(candidate(rounded(other)), items=items, shadow_epsilon=0.0)
    case = replace(EDGE_CASE, most_explained=most, tuned=tuned)

    judged = judge_case(case, [subject], [witness(dict(truth))], ORACLE, {})

    (check,) = (check for check in judged.checks if check.stage is Stage.OBJECT)
    assert check.outcome is (Outcome.PASS if most == 28 / 256 else outcome)
    assert ("rounding explains" in check.reason) == (most < 28 / 256)
