"""`rayproof growth`: what a run costs as the suite grows, or as the code changes."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

USUAL = (100, 1000)
REPLAYED = (1000, 10_000)
NOT_MEASURED = 3
COSTS = ("time [s]", "processor [s]", "largest process [MB]", "folder [MB]")


def growth(
    *cases: int,
    suite: bool = False,
    against: Path | None = None,
    rounds: int = 5,
    replay: Path | None = None,
    select: Annotated[list[str] | None, Parameter(negative=())] = None,
    json: Path | None = None,
) -> int:
    """Run suites of ever more small scenes, each with an empty cache and again with a full one, and show the cost.

    Growth is linear where each further case costs the same from one size to the next: time, memory and folder.

    With --suite --against CHECKOUT the default suite is run instead, in this checkout and in the other one in turns,
    and the ratio of their processor times is shown: what a change of the code costs.

    Parameters
    ----------
    cases
        How many cases each suite has. Default: 100 and 1000. A case takes about half a second of processor time at
        first.
    suite
        Run the default suite of two checkouts; needs --against.
    against
        Another checkout of rayproof, for example made by `git worktree add ../before HEAD~1`. It is run in this Python
        environment.
    rounds
        How often both suites are run, an odd number. A round takes some four minutes on two processors.
    replay
        Render nothing: take the records of this results folder, up to 1000, again and again under new names,
        through the journal and publishing, and show what the process that keeps a run takes. Default of cases: 1000 and
        10000.
    select
        Only these cases of the suite (`shadows`, `transforms/*`); may be given more than once.
    json
        Also write the figures to this file; an interrupted measurement leaves there what it has.

    """
    if suite != (against is not None):
        raise UsageError("--suite and --against CHECKOUT go together: they run the default suite of two checkouts")
    if suite and cases:
        raise UsageError(f"--suite runs the default suite; it takes no number of cases, got {cases[0]}")
    if replay is not None and suite:
        raise UsageError("--replay and --suite are two measurements; ask for one")
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from rayproof.reports.studies.growth.measuring import GrowthError

    try:
        if against is not None:
            _compare(against, tuple(select or ()), rounds, json)
        elif replay is not None:
            _replay(replay, sorted(set(cases or REPLAYED)), json)
        else:
            _grow(sorted(set(cases or USUAL)), json)
    except GrowthError as error:
        say(str(error))
        return NOT_MEASURED
    return 0


def _grow(counts: list[int], json: Path | None) -> None:
    if counts[0] < 1:
        raise UsageError(f"a suite has at least 1 case, got {counts[0]}")
    from rayproof.reports.studies.growth.marginal import marginal
    from rayproof.reports.studies.growth.measuring import measured

    rows: list[dict[str, Any]] = []
    for row in measured(counts):
        rows.append(row)
        say(f"{row['cases']} cases {row['when']}: {row['seconds']:.1f} s")
        write_json(json, {"runs": rows, "further": marginal(rows)})
    head = ["suite", *COSTS]
    show_table("Runs", head, [[f"{row['cases']} {row['when']}", *_cells(row, 1)] for row in rows])
    further = [[f"{one['from']} to {one['to']} {one['when']}", *_cells(one, 1000)] for one in marginal(rows)]
    if further:
        show_table("A thousand further cases", head, further)


def _replay(source: Path, counts: list[int], json: Path | None) -> None:
    if counts[0] < 1:
        raise UsageError(f"a suite has at least 1 case, got {counts[0]}")
    from rayproof.reports.results.document import load_results
    from rayproof.reports.run.replaying import ReplayError, ratios, replayed
    from rayproof.reports.studies.growth.measuring import GrowthError

    with told_in_one_line():
        if not load_results(source)["cases"]:
            raise ValueError(f"{source} has no cases to replay")
    rows: list[dict[str, Any]] = []
    try:
        for row in replayed(source, counts):
            rows.append(row)
            say(f"{row['cases']} cases: {row['seconds']:.1f} s, {1000 * row['seconds'] / row['cases']:.2f} ms a case")
            write_json(json, {"replay": rows, "ratios": ratios(rows)})
    except ReplayError as error:
        raise GrowthError(str(error)) from error
    head = ["cases", "time [s]", "processor [s]", "memory of the parent [MB]", "index.html [MB]"]
    cells = [
        [
            str(row["cases"]),
            *(f"{row[name]:.1f}" for name in ("seconds", "processor_seconds")),
            *(f"{row[name] / 1e6:.2f}" for name in ("parent_peak_bytes", "index_bytes")),
        ]
        for row in rows
    ]
    show_table("Replayed", head, cells)
    if len(rows) > 1:
        show_table("Longest over shortest", ["what", "ratio"], [[k, f"{v:.3f}"] for k, v in ratios(rows).items()])


def _compare(against: Path, selectors: tuple[str, ...], count: int, json: Path | None) -> None:
    from rayproof.reports.studies.growth.checkouts import Round, check, compared, ratios

    with told_in_one_line():
        check(against, count)
    rows: list[Round] = []
    for row in compared(against, selectors, rounds=count):
        rows.append(row)
        cost = f"{row.processor_seconds:.1f} s of processor time in {row.seconds:.1f} s"
        say(f"round {row.number + 1} of {count}, {row.checkout} {row.when}: {cost}")
        write_json(json, {"rounds": [asdict(one) for one in rows], "ratios": ratios(rows)})
    head = ["round", "checkout", *COSTS]
    cells = [[f"{row.number + 1} {row.when}", row.checkout, *_cells(asdict(row), 1)] for row in rows]
    show_table("Rounds", head, cells)
    head = ["when", "processor time, here over against", "95 % interval", "rounds"]
    table = [
        [when, f"{of['ratio']:.3f}", f"{of['interval'][0]:.3f} to {of['interval'][1]:.3f}", of["rounds"]]
        for when, of in ratios(rows).items()
    ]
    show_table("Ratios", head, table)


def _cells(row: dict[str, Any], times: int) -> list[str]:
    seconds = [f"{times * row[name]:.1f}" for name in ("seconds", "processor_seconds")]
    return seconds + [f"{times * row[name] / 1e6:.1f}" for name in ("peak_bytes", "folder_bytes")]
