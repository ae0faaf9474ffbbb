"""results.json: what a run found, as docs/results.md describes it. Loaded, checked in shape, written whole."""

import json
from pathlib import Path
from typing import cast

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.compact import compact, expand
from rayproof.reports.results.json_numbers import as_json
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord, problem

SCHEMA = 2
NAME = "results.json"


class ResultsError(ValueError):
    """A results folder that cannot be read; the message is one line that names the file and the field."""


def load_results(folder: Path) -> RunRecord:
    """Return the contents of `folder`/results.json, checked in shape.

    Raises:
        ResultsError: it is missing, is no JSON, or lacks what every publisher needs.

    """
    path = folder / NAME
    try:
        results = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ResultsError(f"{path}: no such file; `rayproof run --out {folder}` makes it") from error
    except (ValueError, RecursionError) as error:
        raise ResultsError(f"{path}: not JSON: {error}") from error
    if isinstance(results, dict):
        for counts in (results.get("summary"), results.get("checks")):
            if isinstance(counts, dict):
                counts.setdefault(Outcome.UNDECIDED.value, 0)  # what was written before there was such an outcome
    if wrong := problem(results):
        raise ResultsError(f"{path}: {wrong}")
    expand(cast(RunRecord, results))
    return cast(RunRecord, results)


def save_results(folder: Path, results: RunRecord) -> Path:
    """Write results.json whole or not at all and return its path.

    Raises:
        ResultsError: `results` lacks what every publisher needs.

    """
    if wrong := problem(results):
        raise ResultsError(f"{folder / NAME}: {wrong}")
    return write_text(folder / NAME, _a_case_a_line(compact(results)))


def _a_case_a_line(results: RunRecord) -> str:
    """Return JSON that can be read by eye at the top and compared by line below; half the size of an indented one."""
    cases = ",\n".join(map(as_json, results["cases"]))
    rest = {"schema": SCHEMA} | {key: value for key, value in results.items() if key not in ("schema", "cases")}
    return as_json(rest, indent=1)[:-2] + f',\n "cases": [\n{cases}\n ]\n}}\n'
