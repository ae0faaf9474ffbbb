"""The texts that derive limits, each written once: tens of thousands of checks share a few hundred of them."""

from collections.abc import Mapping
from typing import Any

TABLE = "derivations"


def folded(results: Mapping[str, Any]) -> dict[str, Any]:
    """Return `results` with every check's `because` as its place in the table `derivations`; nothing is changed."""
    places: dict[str, int] = {}

    def fold(check: Any) -> Any:
        if not isinstance(check, Mapping) or not isinstance(check.get("because"), str):
            return check
        return {**check, "because": places.setdefault(check["because"], len(places))}

    cases = [
        {**case, "checks": [fold(check) for check in case["checks"]]} if isinstance(case.get("checks"), list) else case
        for case in results["cases"]
    ]
    rest = {key: value for key, value in results.items() if key not in ("cases", TABLE)}
    return {**rest, TABLE: list(places), "cases": cases}


def unfold(results: dict[str, Any]) -> None:
    """Put the texts of `derivations` back into the checks, in place; results without the table stay as they are."""
    table = results.pop(TABLE, None)
    for case in results["cases"]:
        for check in case.get("checks", []):
            place = check.get("because")
            if isinstance(place, int) and not isinstance(place, bool):
                known = isinstance(table, list) and 0 <= place < len(table)
                check["because"] = str(table[place]) if known else ""
