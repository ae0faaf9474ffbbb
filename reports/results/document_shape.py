"""What docs/results.md promises of results.json, as tables: the first thing that is otherwise, in a sentence.

A results folder may come from anybody. Publishers read what is here without looking twice, so that whatever is not here
must be read with care.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from rayproof.reports.results.json_numbers import number
from rayproof.reports.results.outcomes import Outcome

LEDGER = ("planned", *(outcome.value for outcome in Outcome))
READABLE = (1, 2)  # schemas; 1 left nothing out
LONGEST = 80  # characters of a bad value that is shown

Kind = tuple[str, Callable[[Any], bool]]  # what a value must be, in words, and whether it is


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_finite(value: Any) -> bool:
    return not isinstance(value, str) and (found := number(value)) is not None and math.isfinite(found)


def _or_none(kind: Kind) -> Kind:
    words, fits = kind
    return f"{words} or null", lambda value: value is None or fits(value)


def _all(what: str, kind: Kind) -> Kind:
    _, fits = kind
    return what, lambda value: isinstance(value, list | tuple) and all(map(fits, value))


_VERDICT: Kind = (
    f"one of {', '.join(Outcome)}",
    lambda value: isinstance(value, str) and value in set(Outcome),
)
_TEXT: Kind = ("a text", lambda value: isinstance(value, str))
_NAME: Kind = ("a non-empty string", lambda value: isinstance(value, str) and bool(value))
_COUNT: Kind = ("a count", _is_count)
_RATIO: Kind = ('a number, "inf", "-inf" or "nan"', lambda value: number(value) is not None)
MOST_SECONDS = 1e12  # s that a run may have taken; thousandths of it are still numbers of 64 bits
_SECONDS: Kind = (
    f"a number up to {MOST_SECONDS:g}",
    lambda value: value is None or (_is_finite(value) and abs(float(value)) <= MOST_SECONDS),
)
_OBJECT: Kind = ("an object", lambda value: isinstance(value, Mapping))
_LIST: Kind = ("a list", lambda value: isinstance(value, list | tuple))
_MAYBE_TEXT, _MAYBE_RATIO, _MAYBE_OBJECT = map(_or_none, (_TEXT, _RATIO, _OBJECT))
_NAMES = _all("a list of names", _TEXT)
_PATH: Kind = ("a path", lambda value: value is None or isinstance(value, str))

NEEDED: dict[str, Kind] = {"summary": _OBJECT, "checks": _OBJECT, "coverage": _OBJECT, "cases": ("a list", _LIST[1])}
OF_A_RUN: dict[str, Kind] = {
    "environment": _OBJECT,
    "coverage_detail": _OBJECT,
    "references": _MAYBE_OBJECT,
    "absent": _MAYBE_OBJECT,
    "abstained": _MAYBE_OBJECT,
    "examined": _MAYBE_OBJECT,
    "common_factors": _all("a list of objects", _OBJECT),
    "wrong_factors": _NAMES,
    "diagnosis": _all("a list of objects", _OBJECT),
    "faults": _NAMES,
    "paths": _OBJECT,
    "configurations": _NAMES,
    "subject": _TEXT,
    "verdict": _VERDICT,
    "seconds": _SECONDS,
    "gate": _OBJECT,
}
OF_A_GATE: dict[str, Kind] = {
    **dict.fromkeys(("file", "sentence"), _TEXT),
    **dict.fromkeys(("regressions", "tighten", "stale", "expired", "matched", "cases"), _NAMES),
    "red": ("true or false", lambda value: isinstance(value, bool)),
}
OF_A_LATER_GATE: dict[str, Kind] = dict.fromkeys(("worse", "uncovered"), _NAMES)
OF_A_DETAIL: dict[str, Kind] = {"worst_ratio": _MAYBE_RATIO, "references": _NAMES}
OF_A_CASE: dict[str, Kind] = {
    **dict.fromkeys(("stage", "item", "reason", "stresses", "reproduce"), _MAYBE_TEXT),
    **dict.fromkeys(("picture", "view", "thumbnail", "pixels", "scene", "call"), _PATH),
    **dict.fromkeys(("seconds", "judge_seconds"), _SECONDS),
    **dict.fromkeys(("checks", "renders", "unsupported", "expectations", "notes", "consistency"), _LIST),
    "covers": _NAMES,
    "blamed_items": _NAMES,
    "excluded": _OBJECT,
    "adjudication": _MAYBE_OBJECT,
    "paths": _OBJECT,
}
OF_AN_ENTRY: dict[str, dict[str, Kind]] = {
    "checks": {
        **dict.fromkeys(("configuration", "reference", "stage", "reason", "finding"), _MAYBE_TEXT),
        **dict.fromkeys(("end_to_end", "continued", "evidence", "examined", "bias"), _MAYBE_OBJECT),
        "ratio": _MAYBE_RATIO,
    },
    "renders": {
        **dict.fromkeys(("renderer", "configuration", "error"), _MAYBE_TEXT),
        "image": _PATH,
        "seconds": _SECONDS,
    },
    "unsupported": dict.fromkeys(("reference", "stage", "why"), _MAYBE_TEXT),
    "consistency": {
        **dict.fromkeys(("path", "configuration", "with", "how", "stage"), _MAYBE_TEXT),
        "worst": _MAYBE_RATIO,
        "verdict": _VERDICT,
    },
    "expectations": {},
    "notes": {},
}


def shape_problem(results: Any) -> str | None:
    """Return in a sentence what keeps `results` from being published, or None."""
    if not isinstance(results, Mapping):
        return f"must be an object, got {type(results).__name__}"
    if results.get("schema") not in READABLE:
        return f"schema must be one of {', '.join(map(str, READABLE))}, got {_shown(results.get('schema'))}"
    problem = _first(results, NEEDED, "", needed=True) or _first(results, OF_A_RUN, "")
    for key in ("summary", "checks"):
        problem = problem or _first(results[key], dict.fromkeys(LEDGER, _COUNT), f"{key}.", needed=True)
    if problem is not None:
        return problem
    if "gate" in results:
        problem = _first(results["gate"], OF_A_GATE, "gate.", needed=True)
        problem = problem or _first(results["gate"], OF_A_LATER_GATE, "gate.")
        if problem is not None:
            return problem
    for item, detail in results.get("coverage_detail", {}).items():
        where = f"coverage_detail.{item}"
        if problem := _entry_problem(detail, OF_A_DETAIL, where):
            return problem
    return next((told for index, case in enumerate(results["cases"]) if (told := _case_problem(index, case))), None)


def _case_problem(index: int, case: Any) -> str | None:
    where = f"cases[{index}]"
    problem = _entry_problem(case, OF_A_CASE, where) or _first(
        case, {"name": _NAME, "family": _NAME, "verdict": _VERDICT}, f"{where}.", needed=True
    )
    if problem:
        return problem
    for key, kinds in OF_AN_ENTRY.items():
        for place, entry in enumerate(case.get(key, [])):
            at = f"{where}.{key}[{place}]"
            problem = _entry_problem(entry, kinds, at)
            if problem is None and key == "checks":
                problem = _check_problem(entry, at)
            if problem:
                return problem
    return None


def _check_problem(check: Mapping[str, Any], where: str) -> str | None:
    problem = _first(check, {"verdict": _VERDICT}, f"{where}.", needed=True)
    for name in ("end_to_end", "continued"):
        measured = check.get(name)
        if problem is None and measured is not None:
            problem = _first(measured, {"worst_ratio": _MAYBE_RATIO}, f"{where}.{name}.")
    return problem


def _entry_problem(entry: Any, kinds: Mapping[str, Kind], where: str) -> str | None:
    if not isinstance(entry, Mapping):
        return f"{where} must be an object, got {type(entry).__name__}"
    return _first(entry, kinds, f"{where}.")


def _first(holder: Mapping[str, Any], kinds: Mapping[str, Kind], where: str, *, needed: bool = False) -> str | None:
    """Return what is wrong with the first value that is not of its kind; one that is not there is only if needed."""
    for key, (words, fits) in kinds.items():
        value = holder.get(key)
        if (needed or key in holder) and not fits(value):
            simple = value is None or isinstance(value, str | int | float) or not value
            return f"{where}{key} must be {words}, got {_shown(value) if simple else type(value).__name__}"
    return None


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
