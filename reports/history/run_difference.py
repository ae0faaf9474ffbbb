"""The comparison of two runs: every check before and after, and times by case and family."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.reports.history.database import LEAST_RATIO, LOUD, WORSE_TIME, spread
from rayproof.reports.results.case_records import CaseRecord, Check, ComparedCheckRecord, RenderRecord, ratio_of
from rayproof.reports.results.case_table import briefs, by_name
from rayproof.reports.results.document import LISTED, load_results
from rayproof.reports.results.files import SCHEMA, at_worst, number
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.provenance import origin
from rayproof.reports.results.records import ComparedRunRecord, ComparisonRecord, ComparisonRowRecord, RunRecord
from rayproof.reports.studies.compare.findings import BETTER, LEAST_DIGITS, MIXED, NOTHING, WORSE
from rayproof.reports.studies.compare.records import CaseMove, FamilyMove, RunComparison
from rayproof.reports.studies.compare.statistics import LEVEL, REPLICATES, percentile_interval

Case = CaseRecord
ORDER = [outcome.value for outcome in Outcome]  # from the best to the worst


def paired(before: Sequence[str], after: Sequence[str]) -> dict[str, str]:
    """Return the configurations of the later run, mapped to those of the earlier run.

    Configurations with the same name are paired. The others are paired in their order, so that no configuration is
    used twice.
    """
    gone, come = (
        [name for name in this_run if name not in that_run] for this_run, that_run in ((before, after), (after, before))
    )
    placed = dict(zip(come, gone, strict=False))
    return {name: placed.get(name, name) for name in after if name in before or name in placed}


def compared(before: Case, after: Case, pairs: Mapping[str, str]) -> list[ComparedCheckRecord]:
    """Return the checks of a case in either run, the largest change first.

    `configuration` is the name in the later run. `before` and `after` are [verdict, largest error over limit] or null.
    `factor` is the quotient of these ratios, null unless both were measured.
    """
    rows: list[ComparedCheckRecord] = []
    for (configuration, reference, stage), (check_before, check_after) in both(before, after, pairs).items():
        words = [None if check is None else _word(check) for check in (check_before, check_after)]
        rows.append(
            {
                "configuration": configuration,
                "reference": reference,
                "stage": stage,
                "before": words[0],
                "after": words[1],
                "factor": _factor(*words),
            }
        )
    return sorted(rows, key=lambda row: -weight(row))


def both(
    before: Case, after: Case, pairs: Mapping[str, str]
) -> dict[tuple[str, str, str], tuple[Check | None, Check | None]]:
    """Return (configuration, reference, stage) -> the check before and after, for every check in either run."""
    named = {value: key for key, value in pairs.items()}
    earlier = {_key(check, named): check for check in before.get("checks", [])}
    later = {_key(check, {}): check for check in after.get("checks", [])}
    return {key: (earlier.get(key), later.get(key)) for key in dict.fromkeys([*later, *earlier])}


def weight(row: ComparedCheckRecord) -> float:
    """Return the size of a check's change: 100 per step of its verdict, 1 per decade of its error over limit."""
    before, after = row["before"], row["after"]
    if before is None or after is None:
        return 0.0
    steps = abs(ORDER.index(after[0]) - ORDER.index(before[0]))
    return 100.0 * steps + decades(before[1], after[1])


def decades(before: float | None, after: float | None) -> float:
    """Return the change of an error over its limit, up or down, in decades; at most 99."""
    if before is None or after is None:
        return 0.0
    low, high = sorted(max(value, LEAST_RATIO) for value in (before, after))
    return 0.0 if low == high else min(99.0, math.log10(high) - math.log10(low))


def times(before: Case, after: Case, references: Sequence[Sequence[str]]) -> list[float | None]:
    """Return the times [s] of the renderers under test before and after, and their quotient; None if not timed.

    `references` are the names of the references of both runs.
    """
    sides = [_seconds(case, names) for case, names in zip((before, after), references, strict=True)]
    return [*sides, sides[1] / sides[0] if sides[0] and sides[1] else None]


def ours(case: Case, references: Sequence[str]) -> list[str]:
    """Return the names of a case's renderers under test, in order: those that are no references."""
    reference_names = {*references, *(check.reference for check in case.get("checks", []))}
    names = [str(render.get("renderer")) for render in case.get("renders", [])]
    return [name for name in dict.fromkeys(names) if name not in reference_names]


def _seconds(case: Case, references: Sequence[str]) -> float | None:
    own = set(ours(case, references))
    seconds = [
        number(render.get("seconds")) for render in case.get("renders", []) if str(render.get("renderer")) in own
    ]
    total = sum(value for value in seconds if value is not None and math.isfinite(value))
    return total if total > 0 else None


def _key(check: Check, named: Mapping[str, str]) -> tuple[str, str, str]:
    # A check of means over samples has the configuration "CONFIGURATION xSAMPLES".
    name, mark, samples = check.configuration.partition(" x")
    return f"{named.get(name, name)}{mark}{samples}", check.reference, check.stage


def _word(check: Check) -> list[Any]:
    ratio = ratio_of(check)
    return [check.outcome, None if ratio is None else at_worst(ratio)]


def _factor(before: list[Any] | None, after: list[Any] | None) -> float | None:
    if before is None or after is None or before[1] is None or after[1] is None:
        return None
    if before[1] == after[1]:
        return 1.0
    # The ratios are not both 0 or both inf; dividing by inf gives 0.
    return after[1] / before[1] if before[1] > 0 else math.inf


# The record of the comparison: its rows by change, the cases in only one run, and a sentence.


Results = RunRecord


def comparison(before: Results, after: Results, names: tuple[str, str]) -> ComparisonRecord:
    """Return the differences between two runs, which are called `names`; docs/report.md describes the record.

    The cases' records are read in pairs, to save memory. If the runs share more than `LISTED` cases, `rows` contains
    only the cases that changed.

    Raises:
        ValueError: the runs share no case.

    """
    verdicts_before, verdicts_after = (
        {case["name"]: case["verdict"] for case in briefs(run["cases"])} for run in (before, after)
    )
    shared = [name for name in verdicts_after if name in verdicts_before]
    if not shared:
        raise ValueError(f"{names[0]} and {names[1]} share no case")
    pairs = paired(before.get("configurations") or [], after.get("configurations") or [])
    references = [list(run.get("references") or {}) for run in (before, after)]
    first, second = by_name(before["cases"]), by_name(after["cases"])
    rows: dict[str, ComparisonRowRecord] = {}
    quotients: dict[str, float] = {}
    for name in shared:
        row = _row(first(name), second(name), pairs, references)
        if (quotient := row["seconds"][2]) is not None:
            quotients[name] = float(quotient)
        if len(shared) <= LISTED or moved(row):
            rows[name] = row
    # The median contains the effects of the machine on all cases; deviations from it are those of single cases.
    level, noise = spread(list(quotients.values())) if quotients else (None, 0.0)
    for name, quotient in quotients.items():
        if (stands_out := _stands_out(quotient, level, noise)) or name in rows:
            row = rows[name] if name in rows else _row(first(name), second(name), pairs, references)
            rows[name] = {**row, "stands_out": stands_out}
    return {
        "base": _told(before, names[0]),
        "candidate": _told(after, names[1]),
        "faults": sorted({str(fault) for run in (before, after) for fault in run.get("faults") or []}),
        "configurations": pairs,
        "shared": len(shared),
        "time": level,
        "appeared": [[name, verdicts_after[name]] for name in verdicts_after if name not in verdicts_before],
        "vanished": [[name, verdicts_before[name]] for name in verdicts_before if name not in verdicts_after],
        "rows": sorted(rows.values(), key=_order),
    }


def _told(run: Results, name: str) -> ComparedRunRecord:
    return {
        "name": name,
        "command": run.get("command"),
        "started": run.get("started"),
        "rayproof": run.get("rayproof"),
        "verdict": run.get("verdict"),
    }


def names_of(before: Path, after: Path) -> tuple[str, str]:
    """Return the names of two folders, or "before" and "after" if these are the same."""
    names = (before.resolve().name, after.resolve().name)
    return ("before", "after") if names[0] == names[1] else names


def moved(row: ComparisonRowRecord) -> bool:
    """Return whether a case changed by more than noise."""
    return bool(
        row["before"] != row["after"]
        or (row["worst"] is not None and row["decades"] > 0)
        or row.get("pixels")
        or row["stands_out"]
    )


def sentence(record: ComparisonRecord) -> str:
    """Return a sentence that sums up the changes."""
    rows = record["rows"]
    place = ORDER.index
    worse = sum(place(row["after"]) > place(row["before"]) for row in rows)
    better = sum(place(row["after"]) < place(row["before"]) for row in rows)
    factors = [at_worst(row["worst"]["factor"] or 0.0) for row in rows if row["worst"] and row["decades"] > 0]
    grew, shrank = sum(factor > 1 for factor in factors), sum(factor < 1 for factor in factors)
    slower = sum(row["stands_out"] > 0 for row in rows)
    faster = sum(row["stands_out"] < 0 for row in rows)
    pixels = [row["pixels"] for row in rows if row.get("pixels") is not None]
    parts = [
        f"{worse + better} of {record['shared']} verdicts changed, {worse} for the worse",
        f"worst errors grew in {grew} and shrank in {shrank}",
        f"images differ in {sum(map(bool, pixels))} of {len(pixels)}" if pixels else "",
        "" if record["time"] is None else f"times, at different hours: x{record['time']:.3g} in the median case",
        f"{slower} slower and {faster} faster than that explains" if slower or faster else "",
        f"{len(record['appeared'])} appeared" if record["appeared"] else "",
        f"{len(record['vanished'])} vanished" if record["vanished"] else "",
    ]
    return "; ".join(filter(None, parts)) + "."


def _stands_out(quotient: float | None, level: float | None, noise: float) -> int:
    """Return 1 if a case became slower than noise explains, -1 if it became faster, 0 otherwise."""
    if quotient is None or level is None:
        return 0
    excess = float(np.log(quotient / level))
    return 0 if abs(excess) <= max(LOUD * noise, np.log(WORSE_TIME)) else int(np.sign(excess))


def _row(before: Case, after: Case, pairs: Mapping[str, str], references: list[list[str]]) -> ComparisonRowRecord:
    checks = compared(before, after, pairs)
    # The first check that was measured in both runs has the largest change.
    worst, moves = next(
        (
            (check, decades(earlier[1], later[1]))
            for check in checks
            if check["factor"] is not None
            and (earlier := check["before"]) is not None
            and (later := check["after"]) is not None
        ),
        (None, 0.0),
    )
    return {
        "case": after["name"],
        "before": before["verdict"],
        "after": after["verdict"],
        "stage": after.get("stage") or (worst["stage"] if worst else None),
        "worst": worst,
        "decades": moves,
        "seconds": [*times(before, after, references)],
        "stands_out": 0,
        "checks": checks,
    }


def _order(row: Mapping[str, Any]) -> tuple[float, float, float, str]:
    """Return a sort key: first worse verdicts, then large changes of error, then large quotients of times."""
    steps = ORDER.index(row["after"]) - ORDER.index(row["before"])
    return -steps if steps > 0 else steps * 1e-3, -row["decades"], -(row["seconds"][2] or 0.0), row["case"]


# The comparison of two finished runs: changed verdicts, and the change of the largest errors in decimal digits.
#
# Nothing is rendered or timed again. Each render was timed once, at different hours, so that the times are reported but
# not judged, and there is no control.


SEED = 4
# With fewer families no interval is reported: if gains and losses are equally likely, all n families change in the same
# direction with probability 2 / 2^n, which is below 1 - LEVEL from n = 6 on (sign test).
LEAST_FAMILIES = 6


def compare_runs(base: Path, candidate: Path) -> RunComparison:
    """Return the differences between the results of two folders; docs/compare.md describes the record.

    Raises:
        ValueError: results.json is missing or malformed in a folder, or the runs share no case.

    """
    runs = [load_results(folder) for folder in (base, candidate)]
    names_before, names_after = ([case["name"] for case in briefs(run["cases"])] for run in runs)
    there = {*names_after}
    names = [name for name in names_before if name in there]
    if not names:
        raise ValueError(f"{base} and {candidate} share no case")
    pairs = paired(*(run.get("configurations") or [] for run in runs))
    aliases = {earlier: later for later, earlier in pairs.items()}
    # The rows begin with the largest change, as in the report of two runs.
    rows = comparison(runs[0], runs[1], (str(base), str(candidate)))["rows"]
    first, second = (by_name(run["cases"]) for run in runs)
    worst = {row["case"]: row["worst"] for row in rows}
    ordered = dict.fromkeys([*worst, *names])  # long runs have rows only for cases that changed
    cases = [_case(worst.get(name), first(name), second(name), aliases) for name in ordered]
    changed = [case for case in cases if case["before"] != case["after"]]
    moved = [case for case in cases if case["before"] == case["after"] and case["digits_gained"]]
    digits, interval = _digits(cases)
    time_ratio, time_interval = _times(cases)
    families = _families(cases)
    word = _move_word(changed, digits, interval, [family["digits_gained"] for family in families])
    return {
        "schema": SCHEMA,
        "origin": origin(SEED),
        "base": str(base),
        "candidate": str(candidate),
        "configurations": [run.get("configurations", []) for run in runs],
        "faults": sorted({fault for run in runs for fault in run.get("faults", [])}),
        "verdict": _sentence(word, base, candidate, changed, digits, interval, len(names), families),
        "outcome": word,
        "digits_gained": digits,
        "digits_interval": interval,
        "time_ratio": time_ratio,
        "time_interval": time_interval,
        "control": None,
        "families": families,
        "shared": len(names),
        "only_base": sorted(set(names_before) - set(names_after)),
        "only_candidate": sorted(set(names_after) - set(names_before)),
        "changed": [*changed, *moved],
    }


def _case(
    worst: ComparedCheckRecord | None, earlier: CaseRecord, later: CaseRecord, aliases: Mapping[str, str]
) -> CaseMove:
    after = {_check_key(check): check for check in later.get("checks", [])}
    digits: dict[str, float] = {}
    for check in earlier.get("checks", []):
        configuration, reference, stage = _check_key(check)
        match = after.get((aliases.get(configuration, configuration), reference, stage))
        # Only `analytic` has more digits than both runs.
        if match is not None and reference == "analytic":
            gained = _gained(check, match)
            if gained is not None:
                digits[f"{configuration} {stage}"] = gained
    seconds_before, seconds_after = (
        [seconds for render in run.get("renders", []) if (seconds := _render_seconds(render)) > 0]
        for run in (earlier, later)
    )
    return {
        "case": earlier["name"],
        "family": earlier["family"],
        "before": earlier["verdict"],
        "after": later["verdict"],
        "digits_gained": float(np.mean(list(digits.values()))) if digits else None,
        "check": _largest(worst) or str(later.get("reason", "")),
        "seconds": [sum(seconds_before), sum(seconds_after)],
    }


def _largest(check: ComparedCheckRecord | None) -> str:
    """Return the name of the check with the largest change, and its factor; an empty string if nothing changed."""
    if check is None or check["factor"] in (None, 1.0):
        return ""
    where = f"{check['configuration']} {check['reference']} {check['stage']}"
    return f"{where}: error / limit x{check['factor']:.3g}"


def _render_seconds(render: RenderRecord) -> float:
    """Return the time [s] of a render of the tracer; 0 for another renderer."""
    seconds = number(render.get("seconds")) if str(render.get("renderer", "")).startswith("tracer-") else None
    return seconds if seconds is not None and math.isfinite(seconds) else 0.0


def _check_key(check: Check) -> tuple[str, str, str]:
    return check.configuration, check.reference, check.stage


def _gained(before: Check, after: Check) -> float | None:
    """Return log10 of the largest error before over the one after; None if either is zero, infinite or missing."""
    errors = [at_worst((check.end_to_end and check.end_to_end.worst_error) or math.nan) for check in (before, after)]
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
    """Return the mean over families, and its bootstrap interval over families; no interval for few families."""
    means = np.array([np.mean(values) for values in _by_family(cases).values()])
    if len(means) < LEAST_FAMILIES:
        return (float(means.mean()) if len(means) else None), None
    drawn = means[np.random.default_rng(SEED).integers(len(means), size=(REPLICATES, len(means)))].mean(axis=1)
    return float(means.mean()), percentile_interval(drawn, level=LEVEL)


def _times(cases: Sequence[CaseMove]) -> tuple[float | None, tuple[float, float] | None]:
    """Return the median over cases of the tracer's time after over before, and its bootstrap interval."""
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


def _move_word(
    changed: Sequence[CaseMove],
    digits: float | None,
    interval: tuple[float, float] | None,
    families: Sequence[float | None],
) -> str:
    moves = {ORDER.index(case["after"]) > ORDER.index(case["before"]) for case in changed}
    if len(moves) == 2:
        return MIXED
    if moves:
        return WORSE if True in moves else BETTER
    if digits is None or interval is None or abs(digits) < LEAST_DIGITS or interval[0] <= 0 <= interval[1]:
        return NOTHING
    # A family that changed against the mean makes the result mixed.
    if any(gain is not None and gain * digits < 0 and abs(gain) >= LEAST_DIGITS for gain in families):
        return MIXED
    return BETTER if interval[0] > 0 else WORSE


def _sentence(
    word: str,
    base: Path,
    candidate: Path,
    changed: Sequence[CaseMove],
    digits: float | None,
    interval: tuple[float, float] | None,
    shared: int,
    families: Sequence[FamilyMove],
) -> str:
    worst = sorted(changed, key=lambda case: ORDER.index(case["before"]) - ORDER.index(case["after"]))
    named = [f"{case['case']} {case['before']} -> {case['after']}" for case in worst[:4]]
    more = f" and {len(changed) - 4} more" if len(changed) > 4 else ""
    verdicts = f"{len(changed)} of {shared} verdicts changed" + (f": {', '.join(named)}{more}" if named else "")
    errors = "no errors to compare"
    if digits is not None and interval is None:
        errors = (
            f"worst errors {digits:+.2f} digits, which fewer than {LEAST_FAMILIES} families cannot tell from chance"
        )
    elif digits is not None and interval is not None:
        errors = f"worst errors {digits:+.2f} digits [{interval[0]:.2f}, {interval[1]:.2f}]"
    lost = {
        record["family"]: record["digits_gained"]
        for record in families
        if (record["digits_gained"] or 0.0) <= -LEAST_DIGITS
    }
    if word == MIXED and lost:
        (family, least), more = min(lost.items(), key=lambda item: item[1] or 0.0), len(lost) - 1
        errors = f"errors grew in {family} ({least:+.2f} digits){f' and {more} more' if more else ''}; {errors}"
    opening = f"{word[0].upper()}{word[1:]}"
    return f"{opening}: {candidate} against {base}: {verdicts}; {errors}; run times were not interleaved."
