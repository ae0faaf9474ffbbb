"""Guards let an honest harness pass and stop a broken one."""

import pytest

from reference.analytic import Analytic
from reports.cache import judgements
from reports.faults import FAULTS
from reports.judge.sentinels import BrokenJudgeError, stand_guard
from reports.run import plan
from reports.run.guards import BrokenHarnessError, stand_guards
from reports.run.guards.journal import guard_journal
from reports.run.guards.judgements import guard_judgements

GUARDED = [
    name
    for name in FAULTS
    if FAULTS.about(name)["where"] in ("loader", "run") or "analytic" in FAULTS.about(name).get("who", ())
]
# The judge's own take a second each; the audit plants them all.
JUDGE = (
    "edges_excused",
    "limit_times_1000",
    "nan_passes",
    "stage_not_planned",
    "reference_never_suspect",
    "float64_by_float32",
    "reference_not_compared",
)
QUESTION = plan.question


def test_an_honest_harness_passes() -> None:
    stand_guards()


@pytest.mark.parametrize("name", GUARDED)
def test_what_all_renderers_share_is_guarded(name: str) -> None:
    with FAULTS[name](), pytest.raises(BrokenHarnessError, match=r"(is|are) broken"):
        stand_guards()


@pytest.mark.parametrize("name", JUDGE)
def test_the_judge_is_guarded(name: str) -> None:
    with FAULTS[f"judge/{name}"](), pytest.raises(BrokenJudgeError, match="the judge is broken"):
        stand_guard(Analytic())


@pytest.mark.parametrize(
    "broken", [lambda one, who, _: QUESTION(one, who, ""), lambda *_: "0" * 64], ids=["the code", "everything"]
)
def test_a_journals_key_that_leaves_something_out_is_noticed(broken, monkeypatch):
    monkeypatch.setattr(plan, "question", broken)

    with pytest.raises(BrokenHarnessError, match="the journal is broken"):
        guard_journal()


def test_a_journals_key_that_does_not_go_by_this_code_is_noticed(monkeypatch):
    monkeypatch.setattr(plan, "key", lambda one, who: QUESTION(one, who, "of what was here before"))

    with pytest.raises(BrokenHarnessError, match="does not hold the code's digest"):
        guard_journal()


def test_a_verdicts_question_that_leaves_out_which_files_are_kept_is_noticed(monkeypatch):
    right = judgements.question
    monkeypatch.setattr(judgements, "question", lambda *about, files: right(*about, files=""))

    with pytest.raises(BrokenHarnessError, match="what is kept to look at"):
        guard_judgements()
