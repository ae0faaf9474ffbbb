"""comparison.json, which `rayproof compare --out DIR` leaves in a folder, for the report's page of two formulas."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

NAME = "comparison.json"
_OF_ALL = ("base", "candidate", "verdict", "outcome", "repetitions", "stages", "faults")
_OF_A_FAMILY = (
    "family", "stress", "outcome", "scenes", "pixels", "digits_gained", "digits_interval", "time_ratio",
    "time_interval", "nanoseconds_per_ray",
)  # fmt: skip


def contest(folder: Path) -> dict[str, Any] | None:
    """Return what the page shows of a comparison of two formulas, or None without one that can be read."""
    try:
        found = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(found, Mapping) or not isinstance(found.get("families"), list):
        return None
    control, families = found.get("control"), [one for one in found["families"] if _is_family(one)]
    # Two runs have no control, and a report of their own: `rayproof report A B`.
    if not isinstance(control, Mapping) or not families:
        return None
    return {
        **{key: found.get(key) for key in _OF_ALL},
        "control": control.get("verdict"),
        "families": [{key: one.get(key) for key in _OF_A_FAMILY} | {"wrong": _wrong(one)} for one in families],
    }


def _is_family(one: Any) -> bool:
    return isinstance(one, Mapping) and all(
        one.get(key) is None or (isinstance(one[key], list) and len(one[key]) == 2)
        for key in ("digits_interval", "time_interval", "nanoseconds_per_ray")
    )


def _wrong(one: Mapping[str, Any]) -> list[Any]:
    wrong = one.get("wrong")
    return [wrong.get("base"), wrong.get("candidate"), wrong.get("p")] if isinstance(wrong, Mapping) else []
