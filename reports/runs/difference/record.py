"""The comparison of two runs: its rows by change, what appeared and vanished, and the verdict in a sentence."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.reports.results.case_table import briefs, by_name
from rayproof.reports.results.document import LISTED
from rayproof.reports.results.json_numbers import at_worst
from rayproof.reports.results.records import ComparedRunRecord, ComparisonRecord, ComparisonRowRecord, RunRecord
from rayproof.reports.runs.difference.checks import ORDER, Case, compared, decades, paired, times
from rayproof.reports.runs.history.series import WORSE_TIME
from rayproof.reports.runs.history.standing import LOUD
from rayproof.reports.runs.history.steps import NORMAL

Results = RunRecord


def comparison(before: Results, after: Results, names: tuple[str, str]) -> ComparisonRecord:
    """Return what differs between two runs; `names` is what to call them. docs/report.md describes the record.

    Records are read a pair at a time. Of runs that share more than `LISTED` cases `rows` has those that moved alone.

    Raises:
        ValueError: they share no case.

    """
    one, other = ({case["name"]: case["verdict"] for case in briefs(run["cases"])} for run in (before, after))
    shared = [name for name in other if name in one]
    if not shared:
        raise ValueError(f"{names[0]} and {names[1]} share no case")
    pairs = paired(before.get("configurations") or [], after.get("configurations") or [])
    known = [list(run.get("references") or {}) for run in (before, after)]
    first, second = by_name(before["cases"]), by_name(after["cases"])
    rows: dict[str, ComparisonRowRecord] = {}
    quotients: dict[str, float] = {}
    for name in shared:
        row = _row(first(name), second(name), pairs, known)
        if (quotient := row["seconds"][2]) is not None:
            quotients[name] = float(quotient)
        if len(shared) <= LISTED or moved(row):
            rows[name] = row
    level, noise = spread(list(quotients.values()))
    for name, quotient in quotients.items():
        if (stands_out := _stands_out(quotient, level, noise)) or name in rows:
            row = rows[name] if name in rows else _row(first(name), second(name), pairs, known)
            rows[name] = {**row, "stands_out": stands_out}
    return {
        "base": _told(before, names[0]),
        "candidate": _told(after, names[1]),
        "faults": sorted({str(fault) for run in (before, after) for fault in run.get("faults") or []}),
        "configurations": pairs,
        "shared": len(shared),
        "time": level,
        "appeared": [[name, other[name]] for name in other if name not in one],
        "vanished": [[name, one[name]] for name in one if name not in other],
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
    """Return what to call two folders: their last names, or before and after where those are the same."""
    names = (before.resolve().name, after.resolve().name)
    return ("before", "after") if names[0] == names[1] else names


def moved(row: ComparisonRowRecord) -> bool:
    """Return whether anything about a case changed that is more than noise."""
    return bool(
        row["before"] != row["after"]
        or (row["worst"] is not None and row["decades"] > 0)
        or row.get("pixels")
        or row["stands_out"]
    )


def sentence(record: ComparisonRecord) -> str:
    """Return what changed in one sentence."""
    rows = record["rows"]
    place = ORDER.index
    worse = sum(place(row["after"]) > place(row["before"]) for row in rows)
    better = sum(place(row["after"]) < place(row["before"]) for row in rows)
    factors = [at_worst(row["worst"]["factor"] or 0.0) for row in rows if row["worst"] and row["decades"] > 0]
    grew, shrank = sum(factor > 1 for factor in factors), sum(factor < 1 for factor in factors)
    slower = sum(row["stands_out"] > 0 for row in rows)
    faster = sum(row["stands_out"] < 0 for row in rows)
    pixels = [row["pixels"] for row in rows if row.get("pixels") is not None]
    told = [
        f"{worse + better} of {record['shared']} verdicts changed, {worse} for the worse",
        f"worst errors grew in {grew} and shrank in {shrank}",
        f"images differ in {sum(map(bool, pixels))} of {len(pixels)}" if pixels else "",
        "" if record["time"] is None else f"times, at different hours: x{record['time']:.3g} in the median case",
        f"{slower} slower and {faster} faster than that explains" if slower or faster else "",
        f"{len(record['appeared'])} appeared" if record["appeared"] else "",
        f"{len(record['vanished'])} vanished" if record["vanished"] else "",
    ]
    return "; ".join(filter(None, told)) + "."


def spread(quotients: list[float]) -> tuple[float | None, float]:
    """Return the median of quotients of times, and the standard deviation of their logarithms by absolute deviations.

    What one machine does to all cases alike is in the median; what stands out from that is a case's own.
    """
    if not quotients:
        return None, 0.0
    logarithms = np.log(quotients)
    level = float(np.median(logarithms))
    return float(np.exp(level)), NORMAL * float(np.median(np.abs(logarithms - level)))


def _stands_out(quotient: float | None, level: float | None, noise: float) -> int:
    """Return 1 for a case that became slower than noise explains, -1 for one that became faster, 0 otherwise."""
    if quotient is None or level is None:
        return 0
    excess = float(np.log(quotient / level))
    return 0 if abs(excess) <= max(LOUD * noise, np.log(WORSE_TIME)) else int(np.sign(excess))


def _row(before: Case, after: Case, pairs: Mapping[str, str], known: list[list[str]]) -> ComparisonRowRecord:
    checks = compared(before, after, pairs)
    # Measured in both runs: the largest change first.
    worst, moves = next(
        (
            (check, decades(one[1], other[1]))
            for check in checks
            if check["factor"] is not None
            and (one := check["before"]) is not None
            and (other := check["after"]) is not None
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
        "seconds": [*times(before, after, known)],
        "stands_out": 0,
        "checks": checks,
    }


def _order(row: Mapping[str, Any]) -> tuple[float, float, float, str]:
    """Return a key that puts what became worse first, then what moved most, then what takes longer."""
    steps = ORDER.index(row["after"]) - ORDER.index(row["before"])
    return -steps if steps > 0 else steps * 1e-3, -row["decades"], -(row["seconds"][2] or 0.0), row["case"]
