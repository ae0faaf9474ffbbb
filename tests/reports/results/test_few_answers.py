"""A run in which few cases were answered and none failed says so first, and ends with exit code 3."""

from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from rayproof.reports.history.expectations import KnownFailures
from rayproof.reports.history.gating import Demanded
from rayproof.reports.results.headline import few_answers
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.options import RunOptions
from rayproof.reports.run.suite import code_of, least_coverage
from rayproof.reports.run.totals import Totals

GATE = Demanded(expected=("known.json", KnownFailures()))


def options(least: float | None, demanded: Demanded | None = None) -> RunOptions:
    return RunOptions(
        selectors=(),
        out=Path("report"),
        resume=False,
        require=(),
        jobs=1,
        timeout=1.0,
        json=None,
        least_coverage=least,
        demanded=demanded,
        configurations=(),
    )


def run(outcomes: dict[Outcome, int], answered: int, request: RunOptions) -> tuple[int, dict[str, Any]]:
    """Return the exit code and the record of a run whose cases came out so, of which some were answered."""
    found = Totals()
    found.cases.update(outcomes)
    planned = sum(outcomes.values())
    verdict = max((outcome for outcome in outcomes if outcome is not Outcome.UNSUPPORTED), key=[*Outcome].index)
    results: dict[str, Any] = {
        "verdict": verdict.value,
        "summary": {outcome.value: outcomes.get(outcome, 0) for outcome in Outcome} | {"planned": planned},
        "checks": {outcome.value: 0 for outcome in Outcome} | {"planned": 0},
        "answered": {"cases": answered, "planned_cases": planned},
        "least_coverage": least_coverage(request),
        "gate": {
            "red": False,
            "sentence": "Green.",
            "cases": [],
            **{key: [] for key in ("regressions", "expired", "stale", "tighten")},
        },
        "cases": [],
    }
    return code_of(request, results, found, Console(quiet=True), tracer=False), results


FEW = {Outcome.PASS: 1, Outcome.UNSUPPORTED: 5}


@pytest.mark.parametrize(
    ("outcomes", "answered", "least", "demanded", "code"),
    [
        pytest.param(FEW, 1, None, None, 3, id="few"),
        pytest.param(FEW, 1, 10.0, None, 0, id="few are enough"),
        pytest.param({Outcome.PASS: 6}, 6, None, None, 0, id="all"),
        pytest.param({Outcome.PASS: 6}, 6, 100.0, None, 0, id="all are asked for"),
        pytest.param({Outcome.PASS: 5, Outcome.UNSUPPORTED: 1}, 5, 100.0, None, 3, id="all but one"),
        pytest.param({Outcome.FAIL: 1, Outcome.UNSUPPORTED: 5}, 1, None, None, 1, id="few that fail"),
        pytest.param(FEW, 1, None, GATE, 0, id="a gate has its own demands"),
        pytest.param(FEW, 1, 50.0, GATE, 3, id="a gate and a share"),
    ],
)
def test_few_answers_end_with_exit_code_3(outcomes, answered: int, least, demanded, code: int) -> None:
    found, results = run(outcomes, answered, options(least, demanded))

    assert found == code
    assert bool(few_answers(results)) == (code == 3)
