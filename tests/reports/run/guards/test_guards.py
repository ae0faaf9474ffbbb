"""Guards let an honest harness pass and stop a broken one."""

import pytest

from reference.analytic import Analytic
from reports.faults import FAULTS
from reports.judge.sentinels import BrokenJudgeError, stand_guard
from reports.run.guards import BrokenHarnessError, stand_guards

GUARDED = [
    name
    for name in FAULTS
    if FAULTS.about(name)["where"] in ("loader", "run") or "analytic" in FAULTS.about(name).get("who", ())
]
# The judge's own take a second each; the audit plants them all.
JUDGE = ("edges_excused", "limit_times_1000", "nan_passes", "stage_not_planned", "reference_never_suspect")


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
