"""How far a renderer carries: few renders find it, rungs are small scenes, and the tracer agrees with formulas."""

from typing import cast

import pytest

from rayproof.cases.ladders.whole_scenes import SCENE_LADDERS, SceneLadder
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.renderer_limits import MOST_RENDERS, SceneClimb, columns
from rayproof.reports.subjects import THE_TRACER
from tests.reports.checks import recorded

BY_NAME = {ladder.name: ladder for ladder in SCENE_LADDERS}


def climbed(verdicts: str, *, control: bool = False) -> SceneClimb:
    """Climb a ladder whose rungs have these verdicts, a letter each: p for pass, f for fail."""
    ladder = SceneLadder(
        name="made", quantity="Size", unit="m", values=tuple(10.0**rung for rung in range(len(verdicts))),
        scene=BY_NAME["image"].scene, control=control,
    )  # fmt: skip
    found = SceneClimb(ladder=ladder)
    while (rung := found.following()) is not None:
        verdict = {"p": "pass", "f": "fail", "u": "reference_suspect"}[verdicts[rung]]
        found.take(rung, cast(CaseRecord, {"verdict": verdict}), ran=False)
    return found


@pytest.mark.parametrize("right", range(18))
def test_six_renders_find_the_last_rung_that_passes(right: int) -> None:
    found = climbed("p" * right + "f" * (17 - right))

    assert len(found.rungs) <= MOST_RENDERS
    assert found.limit("mine").limit == (10.0 ** (right - 1) if right else None)


def test_a_ladder_out_of_order_is_climbed_whole_and_shows_its_first_failure() -> None:
    found = climbed("pppfppppppppppppp")
    limit = climbed("ppppfffffppppppp").limit("mine")

    assert len(found.rungs) <= MOST_RENDERS  # a single rung may slip through
    assert (limit.limit, limit.breaks_at, limit.monotone, len(limit.rungs)) == (1e3, 1e4, False, 16)


def test_a_control_is_climbed_whole_and_what_the_judges_differ_about_is_undecided() -> None:
    found = climbed("pppu", control=True)

    assert len(found.rungs) == 4
    assert found.limit("mine").verdict == "undecided"


def test_a_stage_that_is_no_longer_answered_ends_the_climb() -> None:
    check = recorded(reference="analytic", stage="visibility", verdict="unsupported", reason="too small")
    given = recorded(reference="analytic", stage="visibility")
    found = SceneClimb(ladder=BY_NAME["offset"])
    for rung, one in ((0, given), (16, check)):
        found.take(rung, cast(CaseRecord, {"verdict": "pass", "checks": [one]}), ran=False)

    assert found.rungs[0].passes
    assert (found.rungs[16].outcome, found.rungs[16].reason) == ("unsupported", "too small")


@pytest.mark.parametrize("ladder", SCENE_LADDERS, ids=lambda ladder: ladder.name)
def test_every_rung_is_a_small_scene_of_float32_numbers(ladder: SceneLadder) -> None:
    scenes = [ladder.case(rung).scene for rung in range(len(ladder.values))]

    assert all(scene.camera.width <= 48 and scene.camera.height <= 48 for scene in scenes)
    assert all(scene.camera.width * scene.camera.height <= 48 * 36 for scene in scenes)
    assert len({scene.camera for scene in scenes} | {scene.shapes for scene in scenes}) > 1 or scenes[0] != scenes[1]


def test_beside_a_subject_stand_the_tracer_and_the_references_once_each() -> None:
    titles = [column.title for column in columns(THE_TRACER, alone=False)]

    assert titles[:2] == ["tracer float32", "tracer float64"]
    assert "radiance" in titles
    assert "analytic" not in titles
    assert [column.title for column in columns(THE_TRACER, alone=True)] == ["tracer float32"]
