"""`python -m tests.harness.paths`: the tracer's execution paths; which are run, compared and shown to matter."""

import json as json_module
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from tests.command_line import call

if TYPE_CHECKING:
    from tests.harness.paths.ledger import AuditedFault, PathEntry

FAILED = 1


def paths(
    *,
    json: Path | None = None,
    compare: Literal["none", "covering", "all"] = "none",
    audit: Path | None = None,
    lines: bool = False,
) -> int:
    """Show the tracer's execution paths: how many cases meet each, what it is compared with, which fault was killed.

    Ends with 1 if a cell is empty: a path that no case of the default suite meets, that nothing compares, or whose
    planted fault survived; and if a route differs. What this machine cannot run, and a fault of which no audit is
    given, is "not measured".

    Parameters
    ----------
    json
        Also write the ledger to this file.
    compare
        Also render cases by the tracer's other routes, and hold these images against the judged ones: by routes that
        cover all paths, on a few cases, or by all of them on every case. By default no image is rendered.
    audit
        The audit.json that the audit of `--only 'path/*'` has written.
    lines
        Show instead which lines of the tracer, formulas aside, no case executes and no list excuses; there should be
        none.

    """
    if lines:
        return executed()
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.cases.families import all_cases
    from tests.harness.audit.planted import in_paths
    from tests.harness.paths.ledger import comparisons, ledger, sentence

    audited, compared = _audited(audit), []
    for one in comparisons(all_cases(), everything=compare == "all") if compare != "none" else ():
        compared.append(one)
        told = sentence(one) if one["verdict"] == "fail" else f"{one['configuration']} by {one['path']}: {one['how']}"
        say(f"{one['case']}: {told}")
    found = ledger(all_cases(), in_paths(), audited=audited, compared=compared)
    write_json(json, found)
    rows = [
        [
            entry["name"],
            entry["declared"],
            str(len(entry["executed"])),
            "; ".join(dict.fromkeys(one["with"] for one in entry["compared"])),
            _worst(entry),
            _killed(entry),
        ]
        for entry in found["paths"]
    ]
    show_table("Paths", ["path", "what it is", "cases", "compared with", "worst / limit", "faults killed"], rows)
    for hole in found["empty"]:
        say(f"empty: {hole}")
    measured = sum(entry["measured"] for entry in found["paths"])
    differ = sum(one["verdict"] == "fail" for one in compared)
    say(f"{len(found['paths'])} paths, {measured} measured, {len(found['empty'])} empty cells")
    say(f"{len(compared)} comparisons, {differ} differ")
    return FAILED if found["empty"] or differ else 0


def _audited(audit: Path | None) -> "list[AuditedFault]":
    """Return the faults of an audit."""
    if audit is None:
        return []
    with told_in_one_line():
        text = audit.read_text(encoding="utf-8")
        try:
            return [fault for fault in json_module.loads(text)["faults"] if fault["name"].startswith("path/")]
        except (ValueError, KeyError, TypeError) as error:
            raise UsageError(f"{audit} is no audit: {error}") from error


def executed() -> int:
    """Say which lines are never executed."""
    from tests.harness.paths.lines import asked

    found = asked()
    for line in found:
        say(line)
    say(f"{len(found)} lines of the tracer are executed by no case, and no list says why")
    return FAILED if found else 0


def _worst(entry: "PathEntry") -> str:
    found = [one["worst"] for one in entry["compared"] if one["worst"] is not None]
    return f"{max(found):.2g}" if found else "not measured" if entry["compared"] else ""


def _killed(entry: "PathEntry") -> str:
    if not entry["measured"]:
        return f"not measured: {entry['why']}" if entry["why"] else ""
    return f"{len(entry['killed'])} of {len(entry['faults'])}"


if __name__ == "__main__":
    sys.exit(call(paths))
