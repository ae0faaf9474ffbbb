"""A broken judge judges nothing, however often it is asked; what nobody judged is recorded like what somebody did."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.judge.limit_sentinels import BrokenJudgeError
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.outcomes import Outcome, exit_code
from rayproof.reports.run import judge_task
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.case_answers import CaseAnswers
from rayproof.reports.run.case_record import unjudged
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.verdict_memory import passed
from rayproof.reports.run.worker_tasks import check_judge, judge
from rayproof.reports.subjects import THE_TRACER
from tests.reports.judge.scenes import CASE, candidate, rounded, truth, witness


@pytest.fixture(autouse=True)
def guarded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Forget, before and after, that the judge was let pass in this process; nothing is kept elsewhere."""
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path / "cache"))
    judge_task.check_judge.cache_clear()
    yield
    judge_task.check_judge.cache_clear()


def faultless() -> CaseAnswers:
    """Return the answers of a faultless float32 renderer and of the oracle."""
    answers = truth()
    return CaseAnswers(subjects=(candidate(rounded(answers)),), references=(witness(answers),))


def options(*, cached: bool = False) -> CaseOptions:
    return CaseOptions(references=(), cached=cached)


@pytest.mark.parametrize("cached", [False, True])
def test_a_broken_judge_judges_nothing_however_often_it_is_asked(cached, tmp_path, monkeypatch):
    def broken(_: Any) -> None:
        asked.append(1)
        raise BrokenJudgeError("the judge is broken: a test says so")

    asked: list[int] = []
    monkeypatch.setattr(judge_task, "stand_guard", broken)

    # Nobody hears the reply to the first order; the ones that follow must not be let pass for it.
    for _ in range(2):
        with pytest.raises(BrokenJudgeError, match="a test says so"):
            check_judge(cached=cached)
    for _ in range(2):
        with pytest.raises(BrokenJudgeError, match="a test says so"):
            judge(CASE, options(cached=cached), faultless(), tmp_path / "run")

    assert len(asked) == 4
    assert not (tmp_path / "run").exists()
    assert not passed("judge", usual_store())


@pytest.mark.parametrize("cached", [False, True])
def test_a_sound_judge_is_asked_once(cached, tmp_path, monkeypatch):
    asked: list[int] = []
    monkeypatch.setattr(judge_task, "stand_guard", lambda _: asked.append(1))

    check_judge(cached=cached)
    assert judge(CASE, options(cached=cached), faultless(), tmp_path / "run")["verdict"] == Outcome.PASS

    assert len(asked) == 1
    assert passed("judge", usual_store()) is cached


def test_what_nobody_judged_has_a_record_of_the_same_keys_in_which_all_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(judge_task, "stand_guard", lambda _: None)
    answers = faultless()
    judged = judge(CASE, options(), answers, tmp_path)
    died = Reply(value=None, error="the worker died (signal SIGABRT)", trace=None, seconds=1.0)
    failed = witness({}, name="another", error="ended by a signal")

    record = unjudged(CASE, answers.subjects, (*answers.references, failed), died, folder=tmp_path, subject=THE_TRACER)

    assert record.keys() == judged.keys() | {"trace"}
    assert {key for one in record["renders"] for key in one} == {key for one in judged["renders"] for key in one}
    assert [(one["renderer"], one["configuration"], one["error"]) for one in record["renders"]] == [
        ("tracer-float32", "float32", None),
        ("analytic", None, None),
        ("another", None, "ended by a signal"),
    ]
    assert record["planned"] == len(record["checks"]) == 2 * judged["planned"]
    assert {check.outcome for check in record["checks"]} == {record["verdict"]} == {Outcome.ERROR}
    assert exit_code([record["verdict"]]) == 3
    assert "SIGABRT" in record["reason"]
    assert (tmp_path / record["scene"]).is_file()
