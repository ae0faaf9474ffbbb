"""`.ci/same_answers` compares two checkouts as if nobody had been compared with the references that are gone."""

import json
import subprocess
import sys
import tomllib
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from rayproof.reports.results.document import load_results, save_results
from tests.reports.commands.conftest import Rayproof

pytestmark = [pytest.mark.process, pytest.mark.references]

SCRIPT = Path(__file__).parents[3] / ".ci" / "same_answers"


@pytest.fixture(scope="module")
def same_answers() -> Any:
    """Return the script as a module."""
    spec = spec_from_loader("same_answers", SourceFileLoader("same_answers", str(SCRIPT)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def read(same_answers: Any, folder: Path, *gone: str) -> dict[str, Any]:
    """Return a results folder as the script reads it."""
    words = [str(folder), json.dumps(gone), "reports.results.document"]
    done = subprocess.run([sys.executable, "-c", same_answers.READ, *words], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_checks_against_what_is_gone_count_in_no_total(same_answers: Any, rayproof: Rayproof, tmp_path: Path) -> None:
    assert rayproof("run", "primitives/square", "--no-cache", "--out", tmp_path).code == 0
    before = read(same_answers, tmp_path)
    results = load_results(tmp_path)
    (case,) = results["cases"]
    extra = [replace(check, reference="gone", ratio=0.99) for check in case["checks"] if check.reference == "radiance"]
    matrix = case["adjudication"]["radiance"]
    size = len(matrix["renderers"])
    ratio = [[*row, 7.0] for row in matrix["ratio"]] + [[7.0] * size + [None]]
    wider = matrix | {"renderers": [*matrix["renderers"], "gone"], "ratio": ratio, "alone": "gone"}
    case |= {
        "checks": [*case["checks"], *extra],
        "planned": case["planned"] + len(extra),
        "adjudication": case["adjudication"] | {"radiance": wider},
    }
    save_results(tmp_path, results | {"cases": [case]})

    with_it, without_it = read(same_answers, tmp_path), read(same_answers, tmp_path, "gone")

    compared = same_answers.Moved(**tomllib.loads(same_answers.MAP.read_text()))
    assert same_answers.answers_of(without_it, compared) == same_answers.answers_of(before, compared)
    assert same_answers.answers_of(with_it, compared) != same_answers.answers_of(before, compared)
