"""Write what fails into a file of expectations, and take out of it what no longer does."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from rayproof.reports.gate.against import GOOD
from rayproof.reports.gate.expectations import EXPECTABLE, Expectation
from rayproof.reports.gate.gating import figures
from rayproof.reports.results.records import RunRecord

SLACK = 0.1  # of error and of wrong pixels, either way: what another processor's roundings may change


def accepted(
    results: RunRecord,
    known: Sequence[Expectation],
    *,
    reason: str,
    expires: str | None,
    issue: str | None,
    when: Mapping[str, str],
) -> tuple[tuple[Expectation, ...], int]:
    """Return the entries with one more for each failing check that none is about, and how many those are."""
    new = []
    for case in results["cases"]:
        for check in case["checks"]:
            if check["verdict"] not in EXPECTABLE or any(
                one.about(case["name"], check) and one.holds_for(results) for one in known
            ):
                continue
            ratio, wrong = figures(check)
            new.append(
                Expectation(
                    case=_plainly(case["name"]),
                    configuration=_plainly(check["configuration"]),
                    reference=_plainly(check["reference"]),
                    stage=check["stage"],
                    verdict=check["verdict"],
                    reason=reason,
                    ratio=(_rounded(ratio / (1 + SLACK)), _rounded(ratio * (1 + SLACK))),
                    wrong=(math.floor(wrong / (1 + SLACK)), math.ceil(wrong * (1 + SLACK))),
                    item=case.get("item"),
                    expires=expires,
                    issue=issue,
                    when=when,
                )
            )
    return (*known, *new), len(new)


def pruned(results: RunRecord, known: Sequence[Expectation]) -> tuple[tuple[Expectation, ...], list[str]]:
    """Return the entries without those whose checks pass, others narrowed to what is there, and what was done.

    It only shrinks: no entry is added, and none becomes wider. Entries about cases that were not run stay as they are.
    """
    kept, done = [], []
    for entry in known:
        checks = [check for case in results["cases"] for check in case["checks"] if entry.about(case["name"], check)]
        planned = any(entry.about_case(case["name"]) for case in results["cases"])
        if not planned or not entry.holds_for(results):
            kept.append(entry)
            continue
        failing = [check for check in checks if check["verdict"] not in GOOD]
        if not failing:
            done.append(f"removed: {entry.name}: {'passes now' if checks else 'no check is called so'}")
            continue
        ratios, wrongs = zip(*map(figures, failing), strict=True)
        narrow = replace(
            entry,
            ratio=_narrowed(entry.ratio, _rounded(max(ratios) * (1 + SLACK)), _rounded(min(ratios) / (1 + SLACK))),
            wrong=_narrowed(entry.wrong, math.ceil(max(wrongs) * (1 + SLACK)), math.floor(min(wrongs) / (1 + SLACK))),
        )
        if narrow != entry:
            done.append(f"narrowed: {entry.name}")
        kept.append(narrow)
    return tuple(kept), done


def _narrowed(old: tuple[Any, Any], high: Any, low: Any) -> tuple[Any, Any]:
    """Return a range that allows no more than before at its upper end, and begins no higher than what is there."""
    return min(old[0], low), min(old[1], max(high, low))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _plainly(name: str) -> str:
    """Return a pattern that means the name and nothing else."""
    return "".join(f"[{one}]" if one in "*?[" else one for one in name)
