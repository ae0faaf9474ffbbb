"""Checks as runs record them, made of the keys that results.json has of them."""

import copy
from typing import Any

import msgspec

from rayproof.reports.results.case_records import Check


def recorded(**facts: Any) -> Check:
    """Return the record of a check by its keys in results.json; `strict` is what the other pixels leave."""
    return msgspec.convert(facts, Check, strict=False)


def listed(results: Any) -> dict[str, Any]:
    """Return a run as earlier schemas had it: every check stands in a list, with its verdict."""
    cases: Any = copy.deepcopy([*results["cases"]])
    for case in cases:
        case["checks"] = [{"verdict": check.outcome.value, **msgspec.to_builtins(check)} for check in case["checks"]]
    return copy.deepcopy({**results, "schema": 3, "cases": None}) | {"cases": cases}
