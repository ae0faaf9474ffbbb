"""Certified arithmetic finds the verdicts that are wrong, whichever side the judge erred on, and no others."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.harness.verdicts.certify import Certified, Inquest, certify
from tests.harness.verdicts.judged_values import certified_answers

ORACLE = Analytic()
(FULL,) = select(["random_scenes/seed_2"])
SMALL = replace(FULL.scene, camera=replace(FULL.scene.camera, width=32, height=24))
CASE = replace(FULL, scene=SMALL, least_interior=0, most_explained=0.5)
TRUTH = ORACLE.render(CASE.scene, stages_of(CASE.scene))
INSIDE = (16, 12)  # a pixel that hits something


def rounded(changes: Mapping[Stage, float] | None = None) -> StageImages:
    """Return the oracle's answers as float32 has them, some of them multiplied by a factor."""
    factors = changes or {}
    return {
        stage: image if stage is Stage.CAMERA else np.float64(np.float32(image) * factors.get(stage, 1.0))
        for stage, image in TRUTH.items()
    }


def candidate(answers: StageImages) -> Answers:
    """Return a renderer in float32 that answers so."""
    return Answers(name="ours", precision="float32", answers=answers)


def witness(answers: StageImages, *, name: str = "analytic", precision: str = "float64") -> Answers:
    """Return a reference that answers so."""
    return Answers(name=name, precision=precision, independent=True, answers=answers)


def judge(case: Case, ours: Answers, witnesses: list[Answers]) -> Judged:
    """Return what the judge says, sentinels aside."""
    return judge_case(case, [ours], witnesses, ORACLE, {})


def certified(judged: Judged, ours: Answers, witnesses: list[Answers]) -> Certified:
    """Return what certified arithmetic says of that."""
    return certify(judged, [ours], witnesses, ORACLE)


def test_a_right_renderer_that_passes_and_a_wrong_one_that_fails_are_no_wrong_verdicts() -> None:
    panel = [witness(TRUTH)]
    for factor, expected in ((1.0, Outcome.PASS), (1.001, Outcome.FAIL)):
        ours = candidate(rounded({Stage.IRRADIANCE: factor, Stage.EXITANCE: factor, Stage.RADIANCE: factor}))
        judged = judge(CASE, ours, panel)

        assert judged.outcome is expected
        assert certified(judged, ours, panel) == Certified()


@pytest.mark.parametrize(("factor", "guilty"), [(1.001, True), (1.0, False)])
def test_a_reference_is_suspected_rightly_only_if_it_is_wrong(factor: float, *, guilty: bool) -> None:
    ours = candidate(rounded())
    other = witness(rounded({Stage.RADIANCE: factor}), name="radiance", precision="float32")
    panel = [witness(TRUTH), replace(other, answers=other.answers | {Stage.RAY: TRUTH[Stage.RAY]})]
    judged = judge(CASE, ours, panel)
    checks = []
    for check in judged.checks:
        if check.reference == "radiance" and check.stage is Stage.RADIANCE:
            assert (check.outcome is Outcome.REFERENCE_SUSPECT) == guilty or not guilty
            checks.append(structs.replace(check, outcome=Outcome.REFERENCE_SUSPECT))
        elif check.outcome is Outcome.REFERENCE_SUSPECT:
            checks.append(
                structs.replace(check, outcome=Outcome.PASS)
            )  # a copy of ours, to the last bit, as it was made
        else:
            checks.append(check)
    judged = replace(judged, checks=checks)

    found = certified(judged, ours, panel)

    assert [(wrong.configuration, wrong.stage) for wrong in found.wrong] == (
        [] if guilty else [("radiance", "radiance")]
    )


def test_garbage_at_one_pixel_is_found_wherever_the_judge_does_not_look() -> None:
    answers = rounded()
    radiance = answers[Stage.RADIANCE].copy()
    radiance[INSIDE[1], INSIDE[0]] = 1e30
    ours, panel = candidate(answers | {Stage.RADIANCE: radiance}), [witness(TRUTH)]
    judged = judge(CASE, ours, panel)
    judged = replace(judged, checks=[structs.replace(check, outcome=Outcome.PASS) for check in judged.checks])

    found = certified(judged, ours, panel)

    assert [(wrong.stage, wrong.pixel) for wrong in found.wrong] == [("radiance", INSIDE)]


def test_what_rounding_decides_is_undecidable_and_no_fault_of_the_judges() -> None:
    # Two planes share four fifths of what is seen.
    (case,) = select(["random/1/18"])
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    rays, size = truth[Stage.RAY].reshape(-1, 3), truth[Stage.OBJECT].shape[:2]
    planes = [index for index, shape in enumerate(case.scene.shapes) if type(shape).__name__ == "Plane"]
    ways = [ORACLE.distances(case.scene, rays, np.tile((index, 0.0), (len(rays), 1))) for index in planes]
    with np.errstate(invalid="ignore"):
        shared = (np.abs(ways[0] - ways[1]) <= 1e-9 * np.abs(ways[0])).reshape(size)
    shared &= np.isin(truth[Stage.OBJECT][..., 0], planes)
    # Who answers sees in each place the plane that the oracle does not.
    named = np.where(truth[Stage.OBJECT][..., 0] == planes[0], planes[1], planes[0])
    spoilt = dict(truth)
    spoilt[Stage.OBJECT] = truth[Stage.OBJECT].copy()
    spoilt[Stage.OBJECT][shared, 0] = named[shared]
    for stage in IMAGE_STAGES[2:]:
        spoilt[stage] = ORACLE.continue_from(case.scene, stage, spoilt)
    answers = {
        stage: image if stage is Stage.CAMERA else np.float64(np.float32(image)) for stage, image in spoilt.items()
    }
    ours, panel = candidate(answers), [witness(truth)]
    judged = judge(case, ours, panel)

    found = certified(judged, ours, panel)

    assert shared.mean() > 0.5
    assert Outcome.UNDECIDED in {check.outcome for check in judged.checks}
    assert (found.wrong, found.undecided, found.undecidable) == ((), (), ("ours",))


def inquest(name: str) -> Inquest:
    """Return a random scene before certified arithmetic."""
    (case,) = select([name])
    stages = tuple(stage for stage in stages_of(case.scene) if stage is not Stage.CAMERA)
    base = scene_truth(case.scene, stages_of(case.scene), ORACLE, known={})
    return Inquest(case=case, base=base, truth={stage: base.truth[stage] for stage in stages})


@pytest.mark.parametrize(("name", "precision", "pixel", "seen", "lit"), [
    ("random/1/147", "float64", (12, 13), 2.0, (1.0, 0.0)),  # in the plane of a triangle that is baked far away
    ("random/2/314", "float32", (24, 16), 4.0, (1.0,)),  # on one of two surfaces that coincide, the light behind them
    ("random/42011/221", "float64", (32, 22), 1.0, (0.0,) * 10),  # above a triangle's normal's horizon, below its plane
    ("random/1/334", "float32", (9, 0), 1.0, (0.0,)),  # of shapes that rounding moves by their own size
])  # fmt: skip
def test_what_rounding_alone_may_show_is_not_called_wrong(name, precision, pixel, seen, lit) -> None:
    found, (column, row) = inquest(name), pixel
    answers = {stage: np.array(image) for stage, image in found.base.truth.items()}
    answers[Stage.OBJECT][row, column] = (seen, 0.0)
    answers[Stage.VISIBILITY][row, column] = lit
    ours = replace(candidate(answers), precision=precision, shadow_epsilon=1e-6)

    wrong = found.of(ours).wrong([pixel], strictly=True)

    assert not {Stage.OBJECT, Stage.VISIBILITY} & set(wrong.get(pixel, ())), wrong


def test_a_light_that_nothing_makes_undecided_is_wrong_if_it_is_not_seen() -> None:
    found, (column, row) = inquest("random/2/314"), (0, 0)
    lit = found.base.truth[Stage.VISIBILITY][..., 0] > 0
    row, column = np.argwhere(lit & ~found.base.beside_changes)[0]
    answers = {stage: np.array(image) for stage, image in found.base.truth.items()}
    answers[Stage.VISIBILITY][row, column] = 0.0
    pixel = (int(column), int(row))

    assert Stage.VISIBILITY in found.of(replace(candidate(answers), name="dark")).wrong([pixel], strictly=True)[pixel]


@pytest.mark.parametrize(("seen", "right"), [(1.0, True), (-1.0, False)], ids=["the-other", "neither"])
def test_of_two_squares_in_one_place_a_renderer_sees_either_but_not_neither(seen: float, *, right: bool) -> None:
    found, (column, row) = inquest("random/73001/29"), (15, 8)
    exact = certified_answers(found.case.scene, tuple(found.truth))
    assert exact is not None
    assert np.isnan(exact[Stage.OBJECT][row, column]).all()
    found = replace(found, truth=exact)
    answers = {stage: np.array(image) for stage, image in found.base.truth.items()}
    answers[Stage.OBJECT][row, column] = (seen, min(seen, 0.0))

    wrong = found.of(candidate(answers)).wrong([(column, row)], strictly=False)

    assert (Stage.OBJECT not in wrong.get((column, row), ())) == right
