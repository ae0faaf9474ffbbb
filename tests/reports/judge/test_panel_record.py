"""Everybody against everybody, who stands alone, and which convention explains it: by test, never by name."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import adjudication, judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import CAMERA, CASE, ORACLE, SCENE, candidate, rounded, truth, witness

HEIGHT, WIDTH = CAMERA.height, CAMERA.width


def other(answers: StageImages, name: str, **more) -> Answers:
    """Return an independent float32 witness, told from others by its last bits."""
    moved = {
        stage: image if stage in (Stage.CAMERA, Stage.OBJECT, Stage.VISIBILITY) else image * (1 + 2.0**-26)
        for stage, image in answers.items()
    }
    return witness(moved, name=name, precision="float32", **more)


def heard(ours: Answers, witnesses: list[Answers], case: Case = CASE) -> tuple:
    """Return the verdict and what the record says of the panel."""
    oracle = ORACLE
    judged = judge_case(case, [ours], witnesses, oracle, {})
    return judged, adjudication(judged, [ours], oracle)


def spoilt(stage: Stage, factor: float = 1.01) -> StageImages:
    """Return the oracle's answers with one stage off."""
    answers = truth()
    return answers | {stage: answers[stage] * factor}


def test_where_all_agree_the_matrix_says_so_and_names_its_baselines():
    _, record = heard(candidate(rounded(truth())), [witness(truth()), other(truth(), "second")])

    assert list(record) == [stage.value for stage in Stage]
    for stage in record.values():
        assert (stage["baseline"], stage["alone"]) == ("analytic", None)
        assert stage["renderers"] == ["float32", "analytic", "second"]
        assert [stage["ratio"][i][i] for i in range(3)] == [None] * 3
        assert all(0 <= stage["ratio"][i][j] <= 1 for i in range(3) for j in range(3) if i != j)
        assert "agree" in stage["why"]


@pytest.mark.parametrize("who", ["float32", "analytic", "second"])
def test_whoever_is_off_stands_alone_be_it_the_oracle(who):
    ours = rounded(spoilt(Stage.RADIANCE) if who == "float32" else truth())
    oracle = witness(spoilt(Stage.RADIANCE) if who == "analytic" else truth())
    second = other(spoilt(Stage.RADIANCE) if who == "second" else truth(), "second")

    judged, record = heard(candidate(ours), [oracle, second])

    radiance = record["radiance"]
    place = radiance["renderers"].index(who)
    rest = [one for one in range(3) if one != place]
    assert radiance["alone"] == who
    assert record["exitance"]["alone"] is None
    assert all(radiance["ratio"][place][one] > 1 and radiance["differing"][place][one] > 300 for one in rest)
    assert radiance["ratio"][rest[0]][rest[1]] <= 1
    assert judged.outcome is (Outcome.FAIL if who == "float32" else Outcome.REFERENCE_SUSPECT)
    if who != "float32":
        (check,) = (c for c in judged.checks if c.stage is Stage.RADIANCE and c.reference == who)
        assert check.evidence["with"] == {"second" if who == "analytic" else "analytic": "radiance"}


def test_two_voices_that_differ_leave_it_open():
    _, record = heard(candidate(rounded(spoilt(Stage.RADIANCE))), [witness(truth())])

    assert record["radiance"]["alone"] is None
    assert "no third voice" in record["radiance"]["why"]


def test_a_majority_against_the_tracer_is_not_overruled_by_one_who_sides_with_it():
    ours, wrong = rounded(spoilt(Stage.RADIANCE)), spoilt(Stage.RADIANCE)
    panel = [witness(truth()), other(truth(), "second"), other(wrong, "third")]

    judged, record = heard(candidate(ours), panel)

    by = {check.reference: check for check in judged.checks if check.stage is Stage.RADIANCE}
    assert judged.outcome is Outcome.FAIL
    assert by["analytic"].outcome is Outcome.FAIL, "one voice for the tracer, one for the oracle: the panel is split"
    assert "split" in by["analytic"].reason
    assert record["radiance"]["alone"] is None


def test_programs_that_share_code_are_one_voice():
    wrong = rounded(spoilt(Stage.RADIANCE))
    panel = [
        witness(truth()),
        other(wrong, "mitsuba_scalar"),
        replace(other(wrong, "mitsuba_llvm"), independent=False),
    ]

    judged, record = heard(candidate(rounded(truth())), panel)

    assert judged.outcome is Outcome.REFERENCE_SUSPECT
    assert record["radiance"]["alone"] == "mitsuba_scalar, mitsuba_llvm"


@pytest.mark.parametrize("shared", [True, False])
def test_two_references_with_shared_code_cannot_outvote_the_oracle(monkeypatch, shared):
    for name in ("pair_one", "pair_two"):
        monkeypatch.setitem(REFERENCES._things, name, Analytic)
        monkeypatch.setitem(REFERENCES._about, name, {"independent": True})
    if shared:
        monkeypatch.setitem(REFERENCES._about, "pair_two", {"independent": True, "shares_code_with": "pair_one"})
    wrong = spoilt(Stage.RADIANCE)
    panel = [witness(truth()), other(truth(), "radiance"), other(wrong, "pair_one"), other(wrong, "pair_two")]

    judged, _ = heard(candidate(rounded(wrong)), panel)

    (check,) = (one for one in judged.checks if (one.reference, one.stage) == ("analytic", Stage.RADIANCE))
    assert check.evidence == {
        "with": dict.fromkeys(("pair_one", "pair_two"), "radiance"),
        "against": {"radiance": "radiance"},
    }
    assert judged.outcome is (Outcome.FAIL if shared else Outcome.REFERENCE_SUSPECT)


def at_corners(down: int, right: int) -> StageImages:
    """Return the oracle's answers at a corner of each pixel."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    points = np.stack([columns.ravel() + right, rows.ravel() + down], axis=-1).astype(float)
    images = [stage for stage in stages_of(SCENE) if stage is not Stage.CAMERA]
    found = ORACLE.at(SCENE, images, points)
    return truth() | {stage: rows.reshape(HEIGHT, WIDTH, -1) for stage, rows in found.items()}


@pytest.mark.parametrize(("down", "right", "words"), [(0, 0, "top left"), (1, 0, "bottom left")])
def test_a_reference_that_samples_corners_is_found_out(down, right, words):
    corner = other(at_corners(down, right), "second")

    _, record = heard(candidate(rounded(truth())), [witness(truth()), corner])

    assert record["ray"]["alone"] == "second"
    assert f"samples each pixel at its {words} corner" in record["ray"]["why"]
    assert [one["what"] for one in record["ray"]["conventions"] if one["explains"]] == [
        f"samples each pixel at its {words} corner"
    ]
    assert "off from ray on" in record["radiance"]["why"]


def seen(scene: Scene) -> tuple[Case, StageImages]:
    """Return a case of a scene and the oracle's answers."""
    case = replace(CASE, scene=scene, least_interior=0, most_explained=0.9)
    return case, ORACLE.render(scene, stages_of(scene))


def test_a_reference_that_clips_at_spheres_is_found_out():
    scene = replace(SCENE, camera=replace(CAMERA, near=4.5))
    case, answers = seen(scene)
    shell = ORACLE.render(replace(scene, clip="shell"), stages_of(scene))

    _, record = heard(candidate(rounded(answers)), [witness(answers), other(shell, "second")], case)

    assert record["object"]["alone"] == "second"
    assert "clips at spheres around the eye" in record["object"]["why"]


def test_a_reference_that_lights_both_sides_is_found_out():
    below = replace(SCENE, lights=(PointLight(position=(1.5, -1.0, -3.0), flux=(100.0, 80.0, 60.0)),))
    scene = replace(below, camera=replace(CAMERA, eye=(3.0, -4.0, -2.5)), shapes=SCENE.shapes[1:])
    case, answers = seen(scene)
    both = replace(scene, shapes=tuple(replace(shape, two_sided=True) for shape in scene.shapes))

    _, record = heard(
        candidate(rounded(answers)), [witness(answers), other(ORACLE.render(both, stages_of(both)), "second")], case
    )

    assert record["normal"]["alone"] == "second"
    assert "both sides of every surface" in record["normal"]["why"]


class Continuing(Analytic):
    """The oracle, except that continuing it takes one pixel's light for hidden, whatever is moved."""

    def __init__(self, pixel: tuple[int, int]) -> None:
        self.place = truth()[Stage.POSITION][pixel]

    def continued(self, scene: Scene, stage: Stage, rows: Any, freedom: Any = None) -> np.ndarray:
        """Answer as the oracle does, but for what is next to that pixel's place."""
        found = super().continued(scene, stage, rows, freedom)
        if stage is Stage.VISIBILITY:
            here = np.linalg.norm(rows[Stage.POSITION] - self.place, axis=1) < 1e-3
            found = np.where(here[:, np.newaxis], 0.0, found)
        return found


def continued_wrong(*others: Answers) -> Judged:
    """Judge a right renderer before an oracle that continues wrongly in one lit pixel far from all that is dark."""
    lit = truth()[Stage.VISIBILITY][..., 0] == 1
    pixels, dark = np.argwhere(lit), np.argwhere(~lit)
    apart = np.linalg.norm(pixels[:, np.newaxis] - dark, axis=-1).min(axis=1)
    row, column = map(int, pixels[np.argmax(apart)])
    return judge_case(CASE, [candidate(rounded(truth()))], [witness(truth()), *others], Continuing((row, column)), {})


def test_two_independent_voices_overrule_what_the_oracle_continued():
    alone = continued_wrong()
    settled = continued_wrong(other(truth(), "certified"), other(truth(), "radiance"))

    assert (alone.outcome, alone.stage) == (Outcome.FAIL, Stage.VISIBILITY)
    assert (settled.outcome, settled.stage) == (Outcome.REFERENCE_SUSPECT, Stage.VISIBILITY)
    check = next(check for check in settled.checks if check.outcome is Outcome.REFERENCE_SUSPECT)
    assert check.reference == "analytic"
    assert check.evidence["with"] == {"certified": "visibility", "radiance": "visibility"}


def test_witnesses_that_the_oracle_does_not_contradict_excuse_nothing():
    # Off by itself by more than its own roundings, and within what the witnesses' limits end to end can tell.
    ours = rounded(truth())
    ours[Stage.EXITANCE] = ours[Stage.EXITANCE] * (1 + 2.0**-21)

    found = judge_case(
        CASE, [candidate(ours)], [witness(truth()), other(truth(), "certified"), other(truth(), "radiance")], ORACLE, {}
    )

    assert (found.outcome, found.stage) == (Outcome.FAIL, Stage.EXITANCE)
    failed = next(check for check in found.checks if check.outcome is Outcome.FAIL)
    assert failed.end_to_end is not None
    assert failed.end_to_end.worst_ratio <= 1
    assert failed.evidence["with"] == {}


def test_what_the_oracle_continued_from_rounded_stages_is_contradicted_by_no_exact_witness():
    # Irradiance is off within its limit, and exitance is exact all the same: it was not made of that irradiance.
    ours = rounded(truth())
    ours[Stage.IRRADIANCE] = ours[Stage.IRRADIANCE] * (1 + 2.0**-21)

    found = judge_case(CASE, [candidate(ours)], [witness(truth()), witness(truth(), name="certified")], ORACLE, {})

    failed = [check for check in found.checks if check.outcome not in (Outcome.PASS, Outcome.UNSUPPORTED)]
    assert {(check.stage, check.outcome) for check in failed} == {(Stage.EXITANCE, Outcome.FAIL)}
    assert found.outcome is Outcome.FAIL
