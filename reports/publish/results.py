"""results.json: what a run found, as docs/results.md describes it. Loaded, checked in shape, written whole."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reports.judge.outcomes import Outcome
from reports.plain import as_json, number
from reports.publish.atomic import write_text
from reports.publish.compact import compact, expand

SCHEMA = 2
READABLE = (1, 2)  # 1 left nothing out
NAME = "results.json"
LEDGER = ("planned", *(outcome.value for outcome in Outcome))


class ResultsError(ValueError):
    """A results folder that cannot be read; the message is one line that names the file and the field."""


def load_results(folder: Path) -> dict[str, Any]:
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
    problem = shape_problem(results)
    if problem:
        raise ResultsError(f"{path}: {problem}")
    expand(results)
    return results


def save_results(folder: Path, results: Mapping[str, Any]) -> Path:
    """Write results.json whole or not at all and return its path.

    Raises:
        ResultsError: `results` lacks what every publisher needs.

    """
    problem = shape_problem(results)
    if problem:
        raise ResultsError(f"{folder / NAME}: {problem}")
    return write_text(folder / NAME, _a_case_a_line(compact(results)))


def _a_case_a_line(results: dict[str, Any]) -> str:
    """Return JSON that can be read by eye at the top and compared by line below; half the size of an indented one."""
    cases = ",\n".join(map(as_json, results["cases"]))
    rest = {"schema": SCHEMA} | {key: value for key, value in results.items() if key not in ("schema", "cases")}
    return as_json(rest, indent=1)[:-2] + f',\n "cases": [\n{cases}\n ]\n}}\n'


def shape_problem(results: Any) -> str | None:
    """Return in a sentence what keeps `results` from being published, or None."""
    if not isinstance(results, Mapping):
        return f"must be an object, got {type(results).__name__}"
    if results.get("schema") not in READABLE:
        return f"schema must be one of {', '.join(map(str, READABLE))}, got {results.get('schema')!r}"
    for key in ("summary", "checks"):
        ledger = results.get(key)
        if not isinstance(ledger, Mapping):
            return f"{key} must be an object, got {type(ledger).__name__}"
        for name in LEDGER:
            count = ledger.get(name)
            if not isinstance(count, int) or isinstance(count, bool) or count < 0:
                return f"{key}.{name} must be a count, got {count!r}"
    if not isinstance(results.get("coverage"), Mapping):
        return f"coverage must be an object, got {type(results.get('coverage')).__name__}"
    for key in ("environment", "coverage_detail"):
        if not isinstance(results.get(key, {}), Mapping):
            return f"{key} must be an object, got {type(results[key]).__name__}"
    if not isinstance(results.get("references") or {}, Mapping):
        return f"references must be an object, got {type(results['references']).__name__}"
    for key in ("faults", "configurations"):
        names = results.get(key, [])
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            return f"{key} must be a list of names, got {names!r}"
    if not _is_verdict(results.get("verdict", Outcome.MISSING)):
        return f"verdict must be one of {', '.join(Outcome)}, got {results['verdict']!r}"
    for item, detail in results.get("coverage_detail", {}).items():
        if not isinstance(detail, Mapping):
            return f"coverage_detail.{item} must be an object, got {type(detail).__name__}"
    if (problem := _seconds_problem("", results)) is not None:
        return problem
    cases = results.get("cases")
    if not isinstance(cases, list):
        return f"cases must be a list, got {type(cases).__name__}"
    return next((problem for index, case in enumerate(cases) if (problem := _case_problem(index, case))), None)


def _case_problem(index: int, case: Any) -> str | None:
    where = f"cases[{index}]"
    if not isinstance(case, Mapping):
        return f"{where} must be an object, got {type(case).__name__}"
    for key in ("name", "family"):
        if not isinstance(case.get(key), str) or not case[key]:
            return f"{where}.{key} must be a non-empty string, got {case.get(key)!r}"
    if not _is_verdict(case.get("verdict")):
        return f"{where}.verdict must be one of {', '.join(Outcome)}, got {case.get('verdict')!r}"
    for key in ("picture", "view"):
        if not isinstance(case.get(key) or "", str):
            return f"{where}.{key} must be a path, got {case[key]!r}"
    for key in ("covers", "checks", "renders", "unsupported", "expectations", "notes"):
        if not isinstance(case.get(key, []), list):
            return f"{where}.{key} must be a list, got {type(case[key]).__name__}"
    for key in ("checks", "renders", "unsupported", "expectations", "notes"):
        for place, entry in enumerate(case.get(key, [])):
            if not isinstance(entry, Mapping):
                return f"{where}.{key}[{place}] must be an object, got {type(entry).__name__}"
    for place, check in enumerate(case.get("checks", [])):
        if not _is_verdict(check.get("verdict")):
            return f"{where}.checks[{place}].verdict must be one of {', '.join(Outcome)}, got {check.get('verdict')!r}"
    return _seconds_problem(f"{where}.", case)


def _is_verdict(value: Any) -> bool:
    return isinstance(value, str) and value in set(Outcome)


def _seconds_problem(where: str, holder: Mapping[str, Any]) -> str | None:
    seconds = holder.get("seconds")
    value = None if isinstance(seconds, str) else number(seconds)
    if seconds is None or (value is not None and math.isfinite(value)):
        return None
    return f"{where}seconds must be a number, got {seconds!r}"
