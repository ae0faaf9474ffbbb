"""Every known mistake can answer a scene, is said in the user's words, and differs from the right answer somewhere."""

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rayproof.cases.case import BLAMABLE
from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis import search as searching
from rayproof.reports.diagnosis.answering import FLOAT32
from rayproof.reports.diagnosis.hypotheses import LEAST_SAMPLES, Hypothesis, bound, estimated, middle
from rayproof.reports.diagnosis.search import search
from rayproof.reports.diagnosis.trials import Evidence, trial
from rayproof.reports.judge.forward.limits import Roundoff

ORACLE = Analytic()
CASES = {
    case.name: case
    for case in select(
        [
            "random_scenes/seed_1",
            "primitives/sphere",
            "primitives/plane",
            "simplified/lights_at_1.5m",
            "several_lights/inverse_square",
            "inside/sphere",
            "combined/19_mesh_turned",
            "combined/29_mesh_mirrored",
        ]
    )
}


def evidence(name: str, answers: dict[Stage, object] | None = None, *, failed: bool = True) -> Evidence:
    scene = CASES[name].scene

    def right() -> dict:
        return ORACLE.render(scene, [Stage.RADIANCE]) if answers is None else answers

    blank = asked(name)
    one = Evidence(case=name, scene=scene, load=right, failed=failed, oracle=ORACLE, undecided=blank.never)
    vars(one)["right"] = blank.right  # a cached property: the same whoever answers
    return one


@cache
def asked(name: str) -> Evidence:
    """Return a case without anybody's answer: the right one, and what the judge leaves undecided, are computed once."""
    return Evidence(case=name, scene=CASES[name].scene, load=dict, failed=False, oracle=ORACLE, undecided=None)


def under(name: str, mistake: str, parameter: float = 0.0) -> Evidence:
    """Return the radiance that a renderer with a mistake writes."""
    way = bound(MISTAKES[mistake].ways[0], parameter)
    answers = evidence(name).under(way).answers
    return evidence(name, {Stage.RADIANCE: answers[Stage.RADIANCE]})


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_said_in_a_verb_phrase_and_concerns_items(name: str) -> None:
    mistake = MISTAKES[name]

    said = mistake.sentence(2.5)

    assert re.fullmatch(r"[a-z].*[^.]", said)
    assert "{" not in said
    assert not re.search(r"\w_\w", said), "the name of a formula is no word of the user's"
    assert set(mistake.items) <= set(BLAMABLE)
    assert mistake.items


@pytest.mark.parametrize("name", MISTAKES)
def test_every_way_of_a_mistake_answers_a_scene_and_none_speaks_against_itself(name: str) -> None:
    scene = evidence("random_scenes/seed_1")
    for way in MISTAKES[name].ways:
        with_it = bound(way, 1.5 if MISTAKES[name].fit is not None else 0.0)
        renderer = evidence("random_scenes/seed_1", dict(scene.under(with_it).answers))
        renderer._kept.update(scene._kept)  # what the way answers is what it answered

        tally = trial(renderer, with_it)

        assert tally is not None
        assert (tally.off, tally.agree) == (0, tally.telling)


def test_normals_of_rounded_corners_are_named_and_no_other_small_error_of_normals_is() -> None:
    cases, name = ("combined/19_mesh_turned", "combined/29_mesh_mirrored"), "normal_of_rounded_corners"
    (way,) = MISTAKES[name].ways

    def named(*, times: float, rounding: Roundoff = FLOAT32, beside: Sequence[str] = ()) -> list[tuple[str, ...]]:
        shown = [evidence(other) for other in beside]
        for case in cases:
            right, wrong = asked(case).right.answers, asked(case).under(way).answers
            normals = right[Stage.NORMAL] + times * (wrong[Stage.NORMAL] - right[Stage.NORMAL])
            one = evidence(case, {**right, Stage.NORMAL: normals})
            shown.append(replace(one, rounding=rounding))
        return [one.hypothesis.mistakes for one in search(shown).found]

    assert named(times=1) == [(name,)]
    assert named(times=1, beside=["primitives/sphere", "primitives/plane"]) == [(name,)], (
        "which fail for another reason"
    )
    assert named(times=-1) == [], "as small, and of no cause that is known"
    assert named(times=1, rounding=Roundoff("float32", baked=True)) == [], "it is declared"


def test_the_right_answer_is_no_mistake() -> None:
    shown = [evidence(name) for name in CASES]

    assert not any(one.wrong.any() for one in shown)
    assert search(shown).found == ()


@pytest.mark.parametrize(("mistake", "parameter"), [("gamma", 2.2), ("falloff_exponent", 1.3), ("cosine_power", 1.5)])
def test_a_parameter_is_estimated_from_the_images(mistake: str, parameter: float) -> None:
    fit, ways = MISTAKES[mistake].fit, MISTAKES[mistake].ways
    assert fit is not None

    found = estimated(
        fit, ways[0], [under(name, mistake, parameter) for name in ("primitives/sphere", "primitives/plane")]
    )

    assert found == pytest.approx(parameter, rel=1e-4)


def test_a_parameter_is_no_next_to_nothing_and_its_samples_agree() -> None:
    level, scattered = np.full(LEAST_SAMPLES, 1.3), np.linspace(0.5, 2.1, LEAST_SAMPLES + 1)

    assert middle([level], nothing=1.0) == pytest.approx(1.3)
    assert middle([scattered], nothing=1.0) is None
    assert middle([level], nothing=1.3) is None
    assert middle([level[1:]], nothing=1.0) is None
    assert middle([0 * level], nothing=1.0) is None


def test_few_or_scattered_samples_estimate_nothing() -> None:
    fit, ways = MISTAKES["gamma"].fit, MISTAKES["gamma"].ways
    assert fit is not None

    assert estimated(fit, ways[0], [under("primitives/sphere", "mean_of_lights")]) is None
    assert LEAST_SAMPLES >= 30


def test_a_passing_case_contradicts_what_the_failing_ones_allow() -> None:
    failing = [under(name, "no_pi") for name in ("primitives/sphere", "primitives/plane", "inside/sphere")]
    contradicted = evidence("several_lights/inverse_square", failed=False)

    alone = search(failing)
    together = search([*failing, contradicted])

    assert ("no_pi",) in [one.hypothesis.mistakes for one in alone.found]
    assert together.found == ()


def test_a_passing_case_contradicts_what_the_stages_of_the_failing_ones_allow() -> None:
    way = MISTAKES["no_pi"].ways[0]
    failing = [
        evidence(name, dict(evidence(name).under(way).answers)) for name in ("primitives/sphere", "inside/sphere")
    ]
    passing = "several_lights/inverse_square"
    contradicted = evidence(passing, dict(asked(passing).right.answers), failed=False)

    assert ("no_pi",) in [one.hypothesis.mistakes for one in search(failing).found]
    assert search([*failing, contradicted]).found == ()


def test_a_factor_of_all_light_is_told_from_one_of_the_physical_light_by_a_case_that_passes() -> None:
    shown = [under(name, "no_pi") for name in ("primitives/sphere", "primitives/plane")]
    simplified = evidence("simplified/lights_at_1.5m", failed=False)

    names = {name for one in search([*shown, simplified]).found for name in one.hypothesis.mistakes}

    assert "no_pi" in names
    assert "factor_of_radiance" not in names, "it would show under the simplified light, too"


def test_a_hypothesis_says_both_of_its_mistakes() -> None:
    pair = Hypothesis(mistakes=("no_pi", "left_handed"), parameters={}, way=MISTAKES["no_pi"].ways[0])

    assert " and " in pair.sentence
    assert set(pair.items) == {"RAD-4", "CAM-1"}


def test_a_name_is_held_against_every_case_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SCREENING", "FAILING"):
        monkeypatch.setattr(searching, name, 1)
    shown = [under(name, "no_pi") for name in ("primitives/sphere", "primitives/plane")]
    last = under("inside/sphere", "two_pi")
    assert ("no_pi",) in [one.hypothesis.mistakes for one in search(shown).found]

    assert search([*shown, last]).found == ()


def test_a_name_that_there_is_no_time_to_hold_against_every_case_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = [under(name, "no_pi") for name in ("primitives/sphere", "primitives/plane")]
    assert search(shown).found
    monkeypatch.setattr(searching, "HOLDING", -1000.0)

    assert search(shown).found == ()


@pytest.mark.parametrize("passing", [10, 0])
def test_a_mistake_in_one_model_of_light_is_named_though_the_other_is_right(
    passing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(searching, "PASSING", passing)  # none: what contradicts comes last
    lit = [under(name, "cosine_squared") for name in ("primitives/sphere", "primitives/plane")]
    # Without a case of the other model nothing says that the mistake is restricted.
    for shown, restricted in (
        (lit, None),
        ([*lit, evidence("simplified/lights_at_1.5m", failed=False)], "inverse_square"),
    ):
        found = search(shown).found

        named = {one.hypothesis.mistakes: one.hypothesis for one in found}
        assert named[("cosine_squared",)].way.shading == restricted
        assert ("in scenes of inverse_square light alone" in named[("cosine_squared",)].sentence) == bool(restricted)


@pytest.mark.parametrize(
    ("mistake", "way", "named"), [("one_pixel_up", 0, set()), ("one_place_off", 4, {"one_place_off"})]
)
def test_an_image_that_is_one_row_off_is_told_from_a_camera_that_is_by_its_first_row(
    mistake: str, way: int, named: set[str]
) -> None:
    shown = []
    for name in ("primitives/plane", "random_scenes/seed_1"):
        answers = evidence(name).under(MISTAKES[mistake].ways[way]).answers
        shown.append(evidence(name, {Stage.RADIANCE: answers[Stage.RADIANCE]}))
    clock = searching.Clock(60)

    found = searching._damaged(shown, shown, [], clock, clock)

    assert {one for each in found for one in each.hypothesis.mistakes} == named
