"""How far a renderer carries: few renders find it, rungs are small scenes, and the tracer agrees with formulas."""

from collections.abc import Mapping
from functools import cache
from typing import cast

import pytest

from rayproof.cases.ladders import all_ladders
from rayproof.cases.ladders.whole_scenes import SCENE_LADDERS, SceneLadder
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.renderer_limits import MOST_RENDERS, Column, SceneClimb, columns, ladders_named, measure
from rayproof.reports.studies.stability.climb import climb, drawn
from rayproof.reports.studies.stability.limit_records import LimitRecord
from rayproof.reports.subjects import THE_TRACER
from rayproof.tracer.formulas import FORMULAS
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
    assert found.limit("mine")["limit"] == (10.0 ** (right - 1) if right else None)


def test_a_ladder_out_of_order_is_climbed_whole_and_shows_its_first_failure() -> None:
    found = climbed("pppfppppppppppppp")
    limit = climbed("ppppfffffppppppp").limit("mine")

    assert len(found.rungs) <= MOST_RENDERS  # a single rung may slip through
    assert (limit["limit"], limit["breaks_at"], limit["monotone"], len(limit["rungs"])) == (1e3, 1e4, False, 16)


def test_a_control_is_climbed_whole_and_what_the_judges_differ_about_is_undecided() -> None:
    found = climbed("pppu", control=True)

    assert len(found.rungs) == 4
    assert found.limit("mine")["verdict"] == "undecided"


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


def test_five_ladders_are_controls() -> None:
    assert sum(ladder.control for ladder in SCENE_LADDERS) == 5


def test_an_unknown_ladder_is_told_with_what_is_known() -> None:
    with pytest.raises(LookupError, match="offset"):
        ladders_named(["SPH-FAR"])


@cache
def limits() -> Mapping[tuple[str, str], LimitRecord]:
    both = [Column(subject=THE_TRACER, configuration=precision) for precision in ("float32", "float64")]
    compared = [ladder for ladder in SCENE_LADDERS if ladder.formulas is not None]
    found = measure(both, compared, jobs=2, seconds=120.0)
    return {(one.renderer.removeprefix("tracer "), one.ladder): one for one in found}


# Near an edge a formula may answer a ray wrongly, and scenes leave the pixels there out: of the rays of a formula
# ladder, which are drawn up to the very edge, so large a share is left out as well.
AT_EDGES = 0.02


@pytest.mark.process
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("ladder", [one for one in SCENE_LADDERS if one.formulas], ids=lambda ladder: ladder.name)
def test_the_tracer_carries_as_far_as_its_formula(ladder: SceneLadder, precision: str) -> None:
    # Beyond what is undecided the scene says nothing; beyond the shorter ladder there is nothing to compare. The
    # ladder `condition` names no formula: the limit of XF-COND grows with the condition number, that of a scene does
    # not, and an inverse matrix in float32 moves the outline of a squeezed sphere by more than nearby problems do.
    assert ladder.formulas is not None
    about = next(one for one in all_ladders() if one.name == ladder.formulas.ladder)
    formula = climb(drawn(about, precision, quick=True), FORMULAS[ladder.formulas.formula])
    reached = None
    for rung in formula.rungs:
        if rung.misclassified > AT_EDGES or (rung.scaled_error or 0) > about.gate.index:
            break
        reached = rung.value
    found = limits()[precision, ladder.name]
    up = ladder.values[-1] > ladder.values[0]
    end = (min if up else max)(ladder.values[-1], about.values[-1])
    assert reached is not None
    assert found.limit is not None
    scene, single = (float((min if up else max)(value, end)) for value in (found.limit, reached))
    farther = scene / single if up else single / scene  # by how much the scene is right beyond the formula

    assert farther <= 10
    assert farther >= 0.1 or found.verdict == "undecided", (found.breaks_at, found.reason)


def test_beside_a_subject_stand_the_tracer_and_the_references_once_each() -> None:
    titles = [column.title for column in columns(THE_TRACER, alone=False)]

    assert titles[:2] == ["tracer float32", "tracer float64"]
    assert "radiance" in titles
    assert "analytic" not in titles
    assert [column.title for column in columns(THE_TRACER, alone=True)] == ["tracer float32"]
