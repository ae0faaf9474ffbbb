"""The kill matrix and the score, for a reader of the terminal."""

from collections.abc import Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rayproof.reports.audit.orders import REFERENCES
from rayproof.reports.results.audit_records import AuditRecord, FaultFinding, LiarFinding
from rayproof.reports.terminal import console as terminal

SHORT = {name: name.removeprefix("mitsuba_") for name in REFERENCES}


def show(console: Console, result: AuditRecord) -> None:
    """Print the matrix, the graded faults, what is wrong and the score."""
    page = console if console.is_terminal else terminal()
    page.print(_matrix(result["faults"]))
    if result["smallest_detected"]:
        page.print(_graded(result["smallest_detected"]))
    if result["items_right"] < result["items_declared"]:
        page.print(_items(result["faults"]))
    for problem in result["problems"]:
        page.print(Text(problem, style="red"), soft_wrap=True)
    page.print(Text(f"{sentence(result)} {result['seconds']} s", style="bold"), soft_wrap=True)


def _matrix(faults: list[FaultFinding]) -> Table:
    table = Table(
        title="fault x reference and family: the stage blamed; - cannot see it, . sees it not", title_justify="left"
    )
    for column in ("fault", "where", "spoils", "killed", *SHORT.values(), "families (killed/cases)"):
        table.add_column(column, overflow="fold")
    for fault in faults:
        looks = [fault["references"].get(name) for name in REFERENCES]
        families = [f"{name} {one['killed']}/{one['cases']}" for name, one in fault["families"].items()]
        table.add_row(
            fault["name"],
            fault["where"],
            fault["stage"],
            Text("equivalent" if fault["equivalent"] else fault["blamed_stage"] or "SURVIVES"),
            *(Text("" if look is None else look["stage"] or ("." if look["sees"] else "-")) for look in looks),
            Text(", ".join(families) or "; ".join(fault["killed_by"])),
        )
    return table


def _items(faults: list[FaultFinding]) -> Table:
    table = Table(title="faults that some case blames on another item of the specification", title_justify="left")
    for column in ("fault", "its items", "blamed"):
        table.add_column(column, overflow="fold")
    for fault in faults:
        if fault["items_right"] is False and fault["equivalent"] is None:
            table.add_row(fault["name"], ", ".join(fault["covers"]), ", ".join(fault["blamed_items"]))
    return table


def _graded(smallest: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Table:
    stages = list(dict.fromkeys(s for one in smallest.values() for found in one.values() for s in found))
    table = Table(title="smallest relative error that each stage detects, 1e-2 to 1e-7", title_justify="left")
    for column in ("quantity", "precision", *stages):
        table.add_column(column)
    for quantity, one in smallest.items():
        for precision, found in one.items():
            table.add_row(quantity, precision, *(f"{found[s]:.1e}" if s in found else "" for s in stages))
    return table


def sentence(audit: AuditRecord) -> str:
    """Return the score in one line."""
    text = (
        f"Audit: {audit['killed']} of {audit['planted'] - audit['equivalent']} planted faults killed, "
        f"{audit['blamed_right']} of them blamed right, {audit['false_alarms']} false alarms; {audit['equivalent']} "
        "more are provably equivalent."
    )
    if audit["items_declared"]:
        text += f" Of {audit['items_declared']} that spoil an item, {audit['items_right']} are blamed on it."
    return text + _liar(audit.get("liar"))


def _liar(liar: LiarFinding | None) -> str:
    """Return what a liar could hide, as a sentence; nothing where none was let loose."""
    if not liar or not liar["pixels"]:
        return ""
    unseen, pixels = liar["spoiled_unseen"], liar["pixels"]
    return (
        f" A liar can spoil {unseen} of {pixels} pixels x stages unseen ({unseen / pixels:.2%}); "
        f"{liar['spoiled_interval']} in intervals, {liar['spoiled_wide']} in wide limits, "
        f"{liar['spoiled_epsilon']} behind an epsilon."
    )
