"""`python -m tests.harness.paths`: the tracer's execution paths; which are run, compared and shown to matter."""

import json as json_module
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from tests.command_line import call

if TYPE_CHECKING:
    from rayproof.reports.paths.ledger import PathEntry

FAILED = 1


def paths(*, json: Path | None = None, keep: Path | None = None, lines: bool = False) -> int:
    """Show the tracer's execution paths: how many cases meet each, what it is compared with, which fault was killed.

    Ends with 1 if a cell is empty: a path that no case of the default suite meets, that nothing compares, or whose
    planted fault survived. What this machine cannot run, and a fault of which the kept audit is of other code, is "not
    measured". No image is rendered.

    Parameters
    ----------
    json
        Also write the ledger to this file.
    keep
        Keep what this audit.json says of the faults in paths, which `rayproof audit --only 'path/*'` has written, or
        this results.json of a run of how its routes compare; what is kept of others stays, if it is of this code.
    lines
        Show instead which lines of the tracer, formulas aside, no case executes and no list excuses; there should be
        none.

    """
    if lines:
        return executed()
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from rayproof.cases.families import all_cases
    from rayproof.reports.paths import ledger
    from rayproof.reports.run.llvm import choose_packaged_llvm
    from tests.harness.audit.planted import in_paths

    choose_packaged_llvm()
    if keep is not None:
        with told_in_one_line():
            text = keep.read_text(encoding="utf-8")
            try:
                said = ledger.keep(json_module.loads(text), in_paths())
            except (ValueError, KeyError, TypeError) as error:
                raise UsageError(f"{keep} is no audit of paths and no run: {error}") from error
        say(f"kept what it says of {said}")
    found = ledger.ledger(all_cases(), in_paths())
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
    say(f"{len(found['paths'])} paths, {measured} measured, {len(found['empty'])} empty cells")
    return FAILED if found["empty"] else 0


def executed() -> int:
    """Say which lines are never executed."""
    from rayproof.reports.paths.lines import asked

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
