"""`python -m tests.harness.paths`: the tracer's execution paths; which are run and compared."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import told_in_one_line, writable_folder
from tests.command_line import call

if TYPE_CHECKING:
    from tests.harness.paths.ledger import PathEntry

FAILED = 1


def paths(*, json: Path | None = None, compare: Literal["none", "covering", "all"] = "none") -> int:
    """Show the tracer's execution paths: how many cases meet each, and what it is compared with.

    Ends with 1 if a cell is empty: a path that no case of the default suite meets, or that nothing compares; and if a
    route differs. What this machine cannot run is "not measured".

    Parameters
    ----------
    json
        Also write the ledger to this file.
    compare
        Also render cases by the tracer's other routes, and hold these images against the judged ones: by routes that
        cover all paths, on a few cases, or by all of them on every case. By default no image is rendered.

    """
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.cases.families import all_cases
    from tests.harness.paths.ledger import comparisons, ledger, sentence

    compared = []
    for one in comparisons(all_cases(), everything=compare == "all") if compare != "none" else ():
        compared.append(one)
        told = sentence(one) if one["verdict"] == "fail" else f"{one['configuration']} by {one['path']}: {one['how']}"
        say(f"{one['case']}: {told}")
    found = ledger(all_cases(), compared=compared)
    write_json(json, found)
    rows = [
        [
            entry["name"],
            entry["declared"],
            str(len(entry["executed"])),
            "; ".join(dict.fromkeys(one["with"] for one in entry["compared"])),
            _worst(entry),
        ]
        for entry in found["paths"]
    ]
    show_table("Paths", ["path", "what it is", "cases", "compared with", "worst / limit"], rows)
    for hole in found["empty"]:
        say(f"empty: {hole}")
    differ = sum(one["verdict"] == "fail" for one in compared)
    say(f"{len(found['paths'])} paths, {len(found['empty'])} empty cells")
    say(f"{len(compared)} comparisons, {differ} differ")
    return FAILED if found["empty"] or differ else 0


def _worst(entry: "PathEntry") -> str:
    if not entry["here"]:
        return "not measured: this machine has no such backend"
    found = [one["worst"] for one in entry["compared"] if one["worst"] is not None]
    return f"{max(found):.2g}" if found else "not measured" if entry["compared"] else ""


if __name__ == "__main__":
    sys.exit(call(paths))
