"""A comparison to read: rows of a table, and the same as Markdown."""

from rayproof.reports.studies.compare.records import FamilyRecord, FormulaComparison, RunComparison
from rayproof.reports.studies.compare.statistics import Interval

COLUMNS: dict[str, tuple[str, ...]] = {
    "formulas": (
        "family", "outcome", "digits gained", "wrong pixels", "p99 error / K u", "time ratio", "A/A", "ns/ray",
    ),
    "runs": ("case", "before", "after", "digits gained", "worst check"),
}  # fmt: skip


def rows(result: FormulaComparison | RunComparison) -> list[list[str]]:
    """Return the table's rows of a comparison of formulas or of runs."""
    if "changed" in result:
        return [
            [one["case"], one["before"], one["after"], _digits(one["digits_gained"], None), one["check"]]
            for one in result["changed"]
        ]
    controls = {one["family"]: one for one in result["control"]["families"]}
    return [_row(one, controls[one["family"]]) for one in result["families"]]


def _row(one: FamilyRecord, control: FamilyRecord) -> list[str]:
    wrong = one["wrong"]
    changed = f"{wrong['base']} -> {wrong['candidate']} of {one['pixels']}"
    tails = [
        " -> ".join(f"{party['scaled']['p99']:.3g}" for party in (pair["base"], pair["candidate"]) if party["scaled"])
        for pair in one["errors"].values()
    ]
    before, after = one["nanoseconds_per_ray"]
    return [
        one["family"],
        one["outcome"],
        _digits(one["digits_gained"], one["digits_interval"]),
        changed,
        ", ".join(tail for tail in tails if tail),
        f"{one['time_ratio']:.3f} {interval(one['time_interval'])}",
        interval(control["time_interval"]),
        f"{before:.2f} -> {after:.2f}",
    ]


def interval(pair: Interval) -> str:
    """Return "[low, high]"."""
    return f"[{pair[0]:.3f}, {pair[1]:.3f}]"


def _digits(value: float | None, bounds: Interval | None) -> str:
    if value is None:
        return "-"
    return f"{value:+.2f}" if bounds is None else f"{value:+.2f} [{bounds[0]:.2f}, {bounds[1]:.2f}]"


def markdown(result: FormulaComparison | RunComparison) -> str:
    """Return the comparison as Markdown."""
    kind = "runs" if "changed" in result else "formulas"
    columns = COLUMNS[kind]
    lines = [f"# {_cell(result['base'])} -> {_cell(result['candidate'])}", "", _cell(result["verdict"]), ""]
    if control := result.get("control"):
        lines += [f"Control: {_cell(control['verdict'])}", ""]
    if result.get("faults"):
        lines.insert(0, f"**PLANTED FAULT IN USE: {', '.join(result['faults'])}**\n")
    lines += ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(map(_cell, row)) + " |" for row in rows(result)]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """Return text that cannot break a table's row or be read as markup."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
