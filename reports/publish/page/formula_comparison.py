"""comparison.json, which `rayproof compare --out DIR` leaves in a folder, for the report's page of two formulas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeGuard

if TYPE_CHECKING:
    from rayproof.reports.studies.compare.records import FamilyRecord, FormulaComparison
    from rayproof.reports.studies.compare.statistics import Interval

NAME = "comparison.json"


class ContestFamily(TypedDict):
    """A family of cases."""

    family: str
    stress: bool
    outcome: str
    scenes: int
    pixels: int
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float
    time_interval: Interval
    nanoseconds_per_ray: tuple[float, float]
    wrong: list[float]  # pixels of the base, of the candidate, and p; empty where nobody says


class Contest(TypedDict):
    """What the page shows."""

    base: str
    candidate: str
    verdict: str
    outcome: str
    repetitions: int
    stages: list[str]
    faults: list[str]
    control: str
    families: list[ContestFamily]


def contest(folder: Path) -> Contest | None:
    """Return what the page shows of a comparison of two formulas, or None without one that can be read."""
    try:
        found = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not _is_comparison(found):
        return None
    control, families = found.get("control"), [_family(one) for one in found["families"] if _is_family(one)]
    # Two runs have no control, and a report of their own: `rayproof report A B`.
    if not isinstance(control, dict) or not families:
        return None
    return {
        "base": found.get("base"),
        "candidate": found.get("candidate"),
        "verdict": found.get("verdict"),
        "outcome": found.get("outcome"),
        "repetitions": found.get("repetitions"),
        "stages": found.get("stages"),
        "faults": found.get("faults"),
        "control": control.get("verdict"),
        "families": families,
    }


def _is_comparison(found: Any) -> TypeGuard[FormulaComparison]:
    """Return whether a file's content is a comparison; its parts are looked at one by one."""
    return isinstance(found, dict) and isinstance(found.get("families"), list)


def _is_family(one: Any) -> bool:
    return isinstance(one, dict) and all(
        one.get(key) is None or (isinstance(one[key], list) and len(one[key]) == 2)
        for key in ("digits_interval", "time_interval", "nanoseconds_per_ray")
    )


def _family(one: FamilyRecord) -> ContestFamily:
    wrong = one.get("wrong")
    return {
        "family": one.get("family"),
        "stress": one.get("stress"),
        "outcome": one.get("outcome"),
        "scenes": one.get("scenes"),
        "pixels": one.get("pixels"),
        "digits_gained": one.get("digits_gained"),
        "digits_interval": one.get("digits_interval"),
        "time_ratio": one.get("time_ratio"),
        "time_interval": one.get("time_interval"),
        "nanoseconds_per_ray": one.get("nanoseconds_per_ray"),
        "wrong": [wrong.get("base"), wrong.get("candidate"), wrong.get("p")] if isinstance(wrong, dict) else [],
    }
