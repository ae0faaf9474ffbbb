"""What a subject cannot do is neither a pass nor a failure, and something must have been measured for a pass."""

from dataclasses import replace
from typing import Any

import pytest

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.results.outcomes import Outcome, concerning
from rayproof.reports.run.totals import of
from tests.reports.judge.scenes import CASE, ORACLE, rounded, truth, witness

CANNOT = "It has nothing of the kind."


def subject(*stages: Stage, wrong: Stage | None = None) -> Answers:
    """Return a renderer that has only some stages, as float32 gives them, one of them a little wrong."""
    given = rounded(truth())
    answers = {stage: given[stage] * 1.001 if stage is wrong else given[stage] for stage in stages}
    return Answers(
        name="subject",
        precision="float32",
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=1e-6,
        answers=answers,
        unsupported={stage: CANNOT for stage in Stage if stage not in stages},
        chained=False,
    )


def judged(one: Answers) -> Judged:
    return of_what_is_supported(judge_case(CASE, [one], [witness(truth())], ORACLE, {}), [one])


@pytest.mark.parametrize("stage", [stage for stage in Stage if stage is not Stage.CAMERA])
def test_one_stage_alone_passes_and_the_others_stay_unsupported(stage: Stage) -> None:
    found = judged(subject(stage))

    outcomes = {check.stage: check.outcome for check in found.checks}
    assert (found.outcome, found.stage, found.reason) == (Outcome.PASS, None, "")
    assert outcomes.pop(stage) is Outcome.PASS
    assert set(outcomes.values()) == {Outcome.UNSUPPORTED}


@pytest.mark.parametrize("stage", [Stage.DISTANCE, Stage.NORMAL, Stage.IRRADIANCE, Stage.RADIANCE])
def test_one_stage_alone_that_is_wrong_fails(stage: Stage) -> None:
    found = judged(subject(stage, wrong=stage))

    assert (found.outcome, found.stage) == (Outcome.FAIL, stage)


@pytest.mark.parametrize("wrong", [None, Stage.RADIANCE])
def test_a_stage_that_is_missing_costs_that_stage_and_not_the_case(wrong: Stage | None) -> None:
    one = subject(Stage.DISTANCE, Stage.RADIANCE, wrong=wrong)
    lacks = replace(
        one,
        unsupported={stage: why for stage, why in one.unsupported.items() if stage is not Stage.NORMAL},
        lacking={Stage.NORMAL: "it declares this stage and wrote no channel of it"},
    )

    found = judged(lacks)

    outcomes = {check.stage: check.outcome for check in found.checks}
    assert outcomes[Stage.NORMAL] is Outcome.MISSING
    assert outcomes[Stage.DISTANCE] is Outcome.PASS
    assert outcomes[Stage.RADIANCE] is (Outcome.PASS if wrong is None else Outcome.FAIL)
    expected = (Outcome.MISSING, Stage.NORMAL) if wrong is None else (Outcome.FAIL, wrong)
    assert (found.outcome, found.stage) == expected


def test_a_stage_that_is_missing_without_a_word_is_not_passed_over() -> None:
    found = judged(replace(subject(Stage.NORMAL), unsupported={}))

    assert found.outcome is Outcome.MISSING
    assert "subject gave no camera" in found.reason


def records(*verdicts: str) -> Any:
    """Return records of cases with these verdicts and no checks."""
    about = {"name": "a/b", "family": "a", "covers": [], "ran": {}, "planned": 0, "checks": []}
    return [about | {"verdict": one} for one in verdicts]


def test_a_run_goes_by_the_cases_that_its_subject_can_do() -> None:
    some = [Outcome.PASS, Outcome.UNSUPPORTED, Outcome.WARN]

    assert concerning(some, tracer=False) == [Outcome.PASS, Outcome.WARN]
    assert concerning(some, tracer=True) == some
    assert concerning([Outcome.UNSUPPORTED, Outcome.ERROR], tracer=False) == [Outcome.UNSUPPORTED, Outcome.ERROR]
    assert of(records("pass", "unsupported")).verdict(planned=2, tracer=False) is Outcome.PASS
    assert of(records("pass", "unsupported")).verdict(planned=2) is Outcome.UNSUPPORTED
    assert of(records("unsupported")).verdict(planned=1, tracer=False) is Outcome.UNSUPPORTED
    assert of(records("pass")).verdict(planned=2, tracer=False) is Outcome.MISSING
