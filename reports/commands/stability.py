"""`rayproof stability`: how far up its ladders each formula climbs, and whether that is what the catalogue says."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from rayproof.reports.commands.lookup import Repeated
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder

if TYPE_CHECKING:
    from rayproof.reports.studies.stability.records import ClimbRecord, SurveyRecord
from rayproof.reports.studies.stability.document import Plan

CLEARED = 100  # columns of an earlier, longer line
SHOWN = 40  # rows of the table, unless formulas or ladders were named
Precisions = Annotated[tuple[Literal["float32", "float64"], ...], Parameter(negative="", show_default=False)]


def stability(
    *formulas: str,
    quick: bool = False,
    ladder: Repeated = (),
    precision: Precisions = (),
    json: Path | None = None,
    out: Path | None = None,
) -> int:
    """Measure formulas on ladders of ill-conditioned inputs.

    Parameters
    ----------
    formulas
        A slot such as sphere, a formula such as sphere/haines, a pattern, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Default: all.
    quick
        Draw fewer rays.
    ladder
        A ladder, such as SPH-FAR, or a pattern. Repeatable. Default: all.
    precision
        float32 or float64. Repeatable. Default: both.
    json
        Also write the results to this file.
    out
        Also write JSON, CSV and SVG of every ladder to OUT/stability.

    """
    with told_in_one_line():
        if out is not None:
            own(out / "stability")
        if json is not None:
            writable_folder(json.parent)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.stability.document import plan, survey

    with told_in_one_line():
        planned = plan(formulas, ladders=ladder, precisions=precision or ("float32", "float64"), quick=quick)
    if not planned.ladders:
        raise UsageError("none of these formulas is measured on any of these ladders")
    doubts: list[str] = []
    records: list[ClimbRecord] = []
    for one in survey(planned, doubts=doubts.append):
        records.append(one)
        tell(len(records), planned.climbs, one)
    surprises = sum(bool(one["surprise"]) for one in records) + len(doubts)
    found = summary(planned, records, doubts, surprises)
    write_json(json, found)
    if out is not None:
        written(out / "stability", planned, found)
    show(records, doubts, surprises, everything=bool(formulas or ladder))
    return 1 if surprises else 0


def tell(done: int, total: int, one: "ClimbRecord") -> None:
    """Say on standard error how far the survey has come; piped, only what is surprising."""
    line = f"[{done}/{total}] {one['ladder']} {one['formula']} {one['precision']}"
    if one["surprise"]:
        sys.stderr.write(f"\r{line}: SURPRISE: {one['surprise']}\n")
    elif sys.stderr.isatty():
        sys.stderr.write(f"\r{line:<{CLEARED}}" + ("\n" if done == total else ""))
        sys.stderr.flush()


def summary(planned: "Plan", records: list["ClimbRecord"], doubts: list[str], surprises: int) -> "SurveyRecord":
    """Return what `--json` writes."""
    from rayproof.reports.studies.stability.device import keeps_subnormals
    from rayproof.tracer.kernel.arrays import versions

    return {
        "schema": 1,
        "ladders": records,
        "surprises": surprises,
        "doubts": doubts,
        "quick": planned.quick,
        "environment": versions(),
        "subnormals": {one: "kept" if keeps_subnormals(one) else "flushed to zero" for one in planned.precisions},
    }


def written(folder: Path, planned: "Plan", found: "SurveyRecord") -> None:
    """Write every ladder's files, a list of them, and what is true of all of them; the report shows these."""
    from rayproof.reports.studies.stability.figures import publish

    for ladder, _ in planned.ladders:
        publish(folder, ladder, [one for one in found["ladders"] if one["ladder"] == ladder.name])
    write_json(folder / "ladders.json", [ladder.name for ladder, _ in planned.ladders])
    write_json(folder / "about.json", {key: value for key, value in found.items() if key != "ladders"})


def show(records: list["ClimbRecord"], doubts: list[str], surprises: int, *, everything: bool) -> None:
    """Print the table, worst first, then what was surprising."""
    from rayproof.reports.studies.stability.document import worst_first

    ordered = worst_first(records)
    kept = ordered if everything else ordered[:SHOWN]
    columns = ["ladder", "formula", "precision", "slope", "predicted", "breakpoint", "error / K u"]
    columns += ["false hits", "false misses", "per million", "verdict", "expected"]
    show_table(f"{len(records)} climbs, worst first", columns, [row(one) for one in kept])
    if len(kept) < len(ordered):
        say(f"and {len(ordered) - len(kept)} more that did no worse; --json or --out holds all")
    for one in ordered:
        if one["surprise"]:
            say(f"SURPRISE: {one['ladder']} {one['formula']} {one['precision']}: {one['surprise']}")
    for doubt in doubts:
        say(f"DOUBT: {doubt}")
    expected = sum(one["expected"] == "fail" for one in records)
    ladders = len({one["ladder"] for one in records})
    say(
        f"{ladders} ladders, {len(records)} climbs, {expected} known failures, "
        f"{surprises} surprise{'' if surprises == 1 else 's'}"
    )


def row(one: "ClimbRecord") -> list[str]:
    """Return one line of the table."""
    slope = "" if one["slope"] is None else f"{one['slope']:.2f}"
    if one["slope_interval"]:
        slope += " [{:.2f}, {:.2f}]".format(*one["slope_interval"])
    counts = ", ".join(f"{name.replace('_', ' ')} {count:.0f}" for name, count in one["per_million"].items())
    return [
        one["ladder"],
        one["formula"],
        one["precision"],
        slope,
        short(one["slope_predicted"]),
        short(one["breakpoint"]) or "none",
        short(one["worst_error_over_Ku"]),
        str(one["false_hits"]),
        str(one["false_misses"]),
        counts,
        one["verdict"],
        one["expected"],
    ]


def short(value: float | None) -> str:
    """Return a cell of three digits, empty where there is nothing."""
    return "" if value is None else f"{value:.3g}"
