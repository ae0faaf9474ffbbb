"""Ladders run on every backend of this machine: the guards hold, and the far sphere follows its law."""

import json
import os
import subprocess
import sys

import drjit as dr
import pytest

from rayproof.reports.cli import NOT_MEASURED
from rayproof.tracer.kernel.arrays import BACKENDS, VARIABLE

pytestmark = pytest.mark.process

# A process chooses its backend once.
CODE = """
import json
from rayproof.reports.studies.stability.device import broken
from rayproof.reports.studies.stability.survey import plan, survey
from rayproof.tracer.kernel.arrays import array_types
both = ("float32", "float64")
planned = plan(("sphere/textbook", "sphere/haines"), ladders=("SPH-FAR",), precisions=both, quick=True)
found = [[one["formula"], one["precision"], one["slope"], one["surprise"]] for one in survey(planned, doubts=print)]
print(json.dumps([array_types("float32").backend, sum(map(broken, both), []), found]))
"""


def ran(backend: str, code: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {VARIABLE: backend}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.fixture(params=list(BACKENDS))
def backend(request: pytest.FixtureRequest) -> str:
    """Name each backend in turn; skip those that Dr.Jit does not find."""
    if not dr.has_backend(BACKENDS[request.param]):
        pytest.skip(f"Dr.Jit finds no {request.param} backend on this machine")
    return request.param


def test_a_backend_keeps_the_guards_and_the_law(backend: str) -> None:
    ended = ran(backend, CODE)

    assert ended.returncode == 0, ended.stderr
    used, broken, found = json.loads(ended.stdout)
    assert (used, broken) == (backend, [])
    assert len(found) == 4
    for formula, _, slope, surprise in found:
        assert surprise == ""
        assert slope == pytest.approx(1.97 if formula == "sphere/textbook" else 0.98, abs=0.1)


def test_a_backend_that_is_not_there_is_told_in_one_line() -> None:
    ended = ran("abacus", "from rayproof.reports.cli import main; raise SystemExit(main(['stability', 'SPH-FAR']))")

    assert ended.returncode == NOT_MEASURED
    assert ended.stderr.count("\n") == 1
    assert f"{VARIABLE}=abacus" in ended.stderr
    assert "cuda, llvm" in ended.stderr
