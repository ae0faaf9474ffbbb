"""Two finished runs: what changed its verdict, and by how many digits the worst errors moved.

Nothing is rendered, so nothing is timed again: each render was timed once, at another hour, which is told and not
judged, and there is no control.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rayproof.reports.results.case_table import briefs, by_name
from rayproof.reports.results.document import load_results
from rayproof.reports.results.json_numbers import at_worst, number
from rayproof.reports.results.records import CaseRecord, CheckRecord, ComparedCheckRecord, RenderRecord
from rayproof.reports.runs.difference.checks import ORDER, paired
from rayproof.reports.runs.difference.record import comparison
from rayproof.reports.studies.compare.findings import LEAST_DIGITS
from rayproof.reports.studies.compare.records import CaseMove, FamilyMove, RunComparison
from rayproof.reports.studies.compare.statistics import LEVEL, REPLICATES, percentile_interval
from rayproof.reports.studies.compare.verdicts import BETTER, NOTHING, TRADE, WORSE

SEED = 4
# Of fewer families no interval is told: if each is as likely to gain as to lose, n of them all move the same way with
# probability 2 / 2^n, which is below 1 - LEVEL from 6 on (sign test).
LEAST_FAMILIES = 6
Check = CheckRecord


def compare_runs(base: Path, candidate: Path) -> RunComparison:
    """Return what differs between the results of two folders, as docs/compare.md describes it.

    Raises:
        ValueError: results.json is missing or malformed in one of them, or they share no case.

    """
    runs = [load_results(folder) for folder in (base, candidate)]
    one, other = ([case["name"] for case in briefs(run["cases"])] for run in runs)
    there = {*other}
    names = [name for name in one if name in there]
    if not names:
        raise ValueError(f"{base} and {candidate} share no case")
    pairs = paired(*(run.get("configurations") or [] for run in runs))
    aliases = {earlier: later for later, earlier in pairs.items()}
    # Rows come with the largest change first, as in the report of the two.
    rows = comparison(runs[0], runs[1], (str(base), str(candidate)))["rows"]
    first, second = (by_name(run["cases"]) for run in runs)
    worst = {row["case"]: row["worst"] for row in rows}
    ordered = dict.fromkeys([*worst, *names])  # of long runs there are rows of what moved alone
    cases = [_case(worst.get(name), first(name), second(name), aliases) for name in ordered]
    changed = [case for case in cases if case["before"] != case["after"]]
    moved = [case for case in cases if case["before"] == case["after"] and case["digits_gained"]]
    digits, interval = _digits(cases)
    time_ratio, time_interval = _times(cases)
    word = _word(changed, digits, interval)
    return {
        "base": str(base),
        "candidate": str(candidate),
        "configurations": [run.get("configurations", []) for run in runs],
        "faults": sorted({fault for run in runs for fault in run.get("faults", [])}),
        "verdict": _sentence(word, base, candidate, changed, digits, interval, len(names)),
        "outcome": word,
        "digits_gained": digits,
        "digits_interval": interval,
        "time_ratio": time_ratio,
        "time_interval": time_interval,
        "control": None,
        "families": _families(cases),
        "shared": len(names),
        "only_base": sorted(set(one) - set(other)),
        "only_candidate": sorted(set(other) - set(one)),
        "changed": [*changed, *moved],
    }


def _case(
    worst: ComparedCheckRecord | None, one: CaseRecord, other: CaseRecord, aliases: Mapping[str, str]
) -> CaseMove:
    after = {_key(check): check for check in other.get("checks", [])}
    digits: dict[str, float] = {}
    for check in one.get("checks", []):
        configuration, reference, stage = _key(check)
        match = after.get((aliases.get(configuration, configuration), reference, stage))
        # `analytic` alone knows more digits than either run has.
        if match is not None and reference == "analytic":
            gained = _gained(check, match)
            if gained is not None:
                digits[f"{configuration} {stage}"] = gained
    ours, theirs = (
        [seconds for render in run.get("renders", []) if (seconds := _seconds(render)) > 0] for run in (one, other)
    )
    return {
        "case": one["name"],
        "family": one["family"],
        "before": one["verdict"],
        "after": other["verdict"],
        "digits_gained": float(np.mean(list(digits.values()))) if digits else None,
        "check": _largest(worst) or str(other.get("reason", "")),
        "seconds": [sum(ours), sum(theirs)],
    }


def _largest(check: ComparedCheckRecord | None) -> str:
    """Return which check changed most, and by how much; an empty string where none did."""
    if check is None or check["factor"] in (None, 1.0):
        return ""
    where = f"{check['configuration']} {check['reference']} {check['stage']}"
    return f"{where}: error / limit x{check['factor']:.3g}"


def _seconds(render: RenderRecord) -> float:
    """Return what a render of the tracer took [s]; 0 of any other."""
    found = number(render.get("seconds")) if str(render.get("renderer", "")).startswith("tracer-") else None
    return found if found is not None and math.isfinite(found) else 0.0


def _key(check: Check) -> tuple[str, str, str]:
    return str(check["configuration"]), str(check["reference"]), str(check["stage"])


def _gained(before: Check, after: Check) -> float | None:
    """Return log10 of the worst error before over that after; None where either is zero, infinite or not there."""
    errors = [at_worst((check.get("end_to_end") or {}).get("worst_error") or math.nan) for check in (before, after)]
    if not all(0 < error < math.inf for error in errors):
        return None
    return math.log10(errors[0] / errors[1])


def _by_family(cases: Sequence[CaseMove]) -> dict[str, list[float]]:
    families: dict[str, list[float]] = {}
    for case in cases:
        if case["digits_gained"] is not None:
            families.setdefault(case["family"], []).append(case["digits_gained"])
    return families


def _digits(cases: Sequence[CaseMove]) -> tuple[float | None, tuple[float, float] | None]:
    """Return the mean over families, and its interval with families drawn again; of few families no interval."""
    means = np.array([np.mean(values) for values in _by_family(cases).values()])
    if len(means) < LEAST_FAMILIES:
        return (float(means.mean()) if len(means) else None), None
    drawn = means[np.random.default_rng(SEED).integers(len(means), size=(REPLICATES, len(means)))].mean(axis=1)
    return float(means.mean()), percentile_interval(drawn, level=LEVEL)


def _times(cases: Sequence[CaseMove]) -> tuple[float | None, tuple[float, float] | None]:
    """Return the median over cases of the seconds that the tracer took, after over before."""
    ratios = np.array([case["seconds"][1] / case["seconds"][0] for case in cases if min(case["seconds"]) > 0])
    if not len(ratios):
        return None, None
    drawn = ratios[np.random.default_rng(SEED).integers(len(ratios), size=(REPLICATES, len(ratios)))]
    return float(np.median(ratios)), percentile_interval(np.median(drawn, axis=1), level=LEVEL)


def _families(cases: Sequence[CaseMove]) -> list[FamilyMove]:
    means = {family: float(np.mean(values)) for family, values in _by_family(cases).items()}
    return [
        {
            "family": family,
            "digits_gained": means.get(family),
            "changed": sum(case["before"] != case["after"] for case in cases if case["family"] == family),
        }
        for family in dict.fromkeys(case["family"] for case in cases)
    ]


def _word(changed: Sequence[CaseMove], digits: float | None, interval: tuple[float, float] | None) -> str:
    moves = {ORDER.index(case["after"]) > ORDER.index(case["before"]) for case in changed}
    if len(moves) == 2:
        return TRADE
    if moves:
        return WORSE if True in moves else BETTER
    if digits is None or interval is None or abs(digits) < LEAST_DIGITS or interval[0] <= 0 <= interval[1]:
        return NOTHING
    return BETTER if interval[0] > 0 else WORSE


def _sentence(
    word: str,
    base: Path,
    candidate: Path,
    changed: Sequence[CaseMove],
    digits: float | None,
    interval: tuple[float, float] | None,
    shared: int,
) -> str:
    said = [f"{case['case']} {case['before']} -> {case['after']}" for case in changed[:4]]
    more = f" and {len(changed) - 4} more" if len(changed) > 4 else ""
    verdicts = f"{len(changed)} of {shared} verdicts changed" + (f": {', '.join(said)}{more}" if said else "")
    errors = "no errors to compare"
    if digits is not None and interval is None:
        errors = (
            f"worst errors {digits:+.2f} digits, which fewer than {LEAST_FAMILIES} families cannot tell from chance"
        )
    elif digits is not None and interval is not None:
        errors = f"worst errors {digits:+.2f} digits [{interval[0]:.2f}, {interval[1]:.2f}]"
    opening = f"{word[0].upper()}{word[1:]}"
    return f"{opening}: {candidate} against {base}: {verdicts}; {errors}; run times were not interleaved."
