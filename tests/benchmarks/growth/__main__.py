"""`python -m tests.benchmarks.growth`: what a run costs as the suite grows, or as the code changes."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from tests.command_line import call

if TYPE_CHECKING:
    from tests.benchmarks.growth.checkouts import Round
    from tests.benchmarks.growth.measuring import Cost, Further, SuiteCost

USUAL = (100, 1000)
NOT_MEASURED = 3
COSTS = ("time [s]", "processor [s]", "largest process [MB]", "folder [MB]")


def growth(
    *cases: int,
    suite: bool = False,
    against: Path | None = None,
    rounds: int = 5,
    scheduler: str | None = None,
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
    scheduler
        local:N. Run each suite at first, once by N processes and once by a cluster of N workers on this machine, and
        show what the cluster takes over what the processes take, and how much of it the process that was called takes.
    select
        Only these cases of the suite (`shadows`, `transforms/*`); may be given more than once.
    json
        Also write the figures to this file; an interrupted measurement leaves there what it has.

    """
    if suite != (against is not None):
        raise UsageError("--suite and --against CHECKOUT go together: they run the default suite of two checkouts")
    if suite and cases:
        raise UsageError(f"--suite runs the default suite; it takes no number of cases, got {cases[0]}")
    if scheduler is not None and suite:
        raise UsageError("--scheduler compares a cluster with this machine's processes; ask for nothing else with it")
    counts = sorted(set(cases or USUAL))
    if counts[0] < 1:
        raise UsageError(f"a suite has at least 1 case, got {counts[0]}")
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    from tests.benchmarks.growth.measuring import GrowthError

    try:
        if against is not None:
            _compare(against, tuple(select or ()), rounds, json)
        elif scheduler is not None:
            _beside(scheduler, counts, json)
        else:
            _grow(counts, json)
    except GrowthError as error:
        say(str(error))
        return NOT_MEASURED
    return 0


def _grow(counts: list[int], json: Path | None) -> None:
    from tests.benchmarks.growth.measuring import SuiteCost, marginal, measured

    rows: list[SuiteCost] = []
    for row in measured(counts):
        rows.append(row)
        say(f"{row.cases} cases {row.when}: {row.cost.seconds:.1f} s")
        further = [_renamed(asdict(one)) for one in marginal(rows)]
        write_json(json, {"runs": [_flat(one) for one in rows], "further": further})
    head = ["suite", *COSTS]
    show_table("Runs", head, [[f"{row.cases} {row.when}", *_cells(row.cost, 1)] for row in rows])
    table = [[f"{one.fewer} to {one.more} {one.when}", *_cells(one, 1000)] for one in marginal(rows)]
    if table:
        show_table("A thousand further cases", head, table)


def _beside(scheduler: str, counts: list[int], json: Path | None) -> None:
    from rayproof.reports.commands.cluster import scheduler_at
    from tests.benchmarks.growth.measuring import SuiteCost, beside_a_cluster, cluster_ratios

    place = scheduler_at(scheduler, None) if "://" not in scheduler else None
    if place is None:
        raise UsageError(f"--scheduler is local:N here, whose processor time can be measured; got {scheduler}")
    rows: list[SuiteCost] = []
    for row in beside_a_cluster(counts, place.local):
        rows.append(row)
        cost, how = row.cost, row.engine or f"--jobs {place.local}"
        say(f"{row.cases} cases, {how}: {cost.processor_seconds:.1f} s of processor time in {cost.seconds:.1f} s")
        write_json(json, {"runs": [_flat(one) for one in rows], "ratios": cluster_ratios(rows)})
    head = ["suite", *COSTS, "of it the process that was called [s]", "its memory [MB]", "index.html [MB]"]
    table = [
        [
            f"{row.cases} {row.engine or f'--jobs {place.local}'}",
            *_cells(row.cost, 1),
            f"{row.cost.parent_processor_seconds:.1f}",
            *(f"{size / 1e6:.2f}" for size in (row.cost.parent_peak_bytes, row.cost.index_bytes)),
        ]
        for row in rows
    ]
    show_table("Runs", head, table)
    names = ["cases", "processor", "seconds", "parent_share", "parent_peak"]
    ratios = [[f"{one[name]:.3g}" for name in names] for one in cluster_ratios(rows)]
    show_table(f"{scheduler} over --jobs {place.local}", names, ratios)


def _compare(against: Path, selectors: tuple[str, ...], count: int, json: Path | None) -> None:
    from tests.benchmarks.growth.checkouts import Round, check, compared, ratios

    with told_in_one_line():
        check(against, count)
    rows: list[Round] = []
    for row in compared(against, selectors, rounds=count):
        rows.append(row)
        cost = f"{row.cost.processor_seconds:.1f} s of processor time in {row.cost.seconds:.1f} s"
        say(f"round {row.number + 1} of {count}, {row.checkout} {row.when}: {cost}")
        found = {when: asdict(of) for when, of in ratios(rows).items()}
        write_json(json, {"rounds": [_flat(one) for one in rows], "ratios": found})
    head = ["round", "checkout", *COSTS]
    cells = [[f"{row.number + 1} {row.when}", row.checkout, *_cells(row.cost, 1)] for row in rows]
    show_table("Rounds", head, cells)
    head = ["when", "processor time, here over against", "95 % interval", "rounds"]
    table = [
        [when, f"{of.ratio:.3f}", f"{of.interval[0]:.3f} to {of.interval[1]:.3f}", of.rounds]
        for when, of in ratios(rows).items()
    ]
    show_table("Ratios", head, table)


def _flat(row: "SuiteCost | Round") -> dict[str, object]:
    """Return a row as JSON data, what it cost beside what was run."""
    found = asdict(row)
    return found | found.pop("cost")


def _renamed(row: dict[str, object]) -> dict[str, object]:
    """Return what further cases cost as it has always been written."""
    return {"when": row["when"], "from": row["fewer"], "to": row["more"]} | {
        name: value for name, value in row.items() if name not in ("when", "fewer", "more")
    }


def _cells(cost: "Cost | Further", times: int) -> list[str]:
    seconds = [f"{times * one:.1f}" for one in (cost.seconds, cost.processor_seconds)]
    return seconds + [f"{times * one / 1e6:.1f}" for one in (cost.peak_bytes, cost.folder_bytes)]


if __name__ == "__main__":
    sys.exit(call(growth))
