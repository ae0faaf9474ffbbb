"""`rayproof growth`: what a run costs as the suite grows."""

from pathlib import Path
from typing import Any

from reports.commands.output import say, show_table, write_json
from reports.commands.usage import UsageError, told_in_one_line, writable_folder

USUAL = (100, 1000)
NOT_MEASURED = 3


def growth(*cases: int, json: Path | None = None) -> int:
    """Run suites of ever more small scenes, each with an empty cache and again with a full one, and show the cost.

    Growth is linear where each further case costs the same from one size to the next: time, memory and folder.

    Parameters
    ----------
    cases
        How many cases each suite has. Default: 100 and 1000. A case takes about half a second of processor time at
        first.
    json
        Also write the figures to this file; an interrupted measurement leaves there what it has.

    """
    counts = sorted(set(cases or USUAL))
    if counts[0] < 1:
        raise UsageError(f"a suite has at least 1 case, got {counts[0]}")
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from reports.growth.marginal import marginal
    from reports.growth.measuring import GrowthError, measured
    from reports.run.stopping import terminated_as_interrupted

    rows: list[dict[str, Any]] = []
    try:
        # A suite under way ends with the measurement, however that is stopped.
        with terminated_as_interrupted():
            for row in measured(counts):
                rows.append(row)
                say(f"{row['cases']} cases {row['when']}: {row['seconds']:.1f} s")
                write_json(json, {"runs": rows, "further": marginal(rows)})
    except GrowthError as error:
        say(str(error))
        return NOT_MEASURED
    head = ["suite", "time [s]", "processor [s]", "largest process [MB]", "folder [MB]"]
    show_table("Runs", head, [[f"{row['cases']} {row['when']}", *_cells(row, 1)] for row in rows])
    further = [[f"{one['from']} to {one['to']} {one['when']}", *_cells(one, 1000)] for one in marginal(rows)]
    if further:
        show_table("A thousand further cases", head, further)
    return 0


def _cells(row: dict[str, Any], times: int) -> list[str]:
    seconds = [f"{times * row[name]:.1f}" for name in ("seconds", "processor_seconds")]
    return seconds + [f"{times * row[name] / 1e6:.1f}" for name in ("peak_bytes", "folder_bytes")]
