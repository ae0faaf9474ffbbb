"""Progress on the terminal: a bar, or a line for each case, and a final table with the worst first."""

import time
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rayproof.reports.results.case_records import CaseRecord, ratio_of
from rayproof.reports.results.case_table import Cases
from rayproof.reports.results.files import at_worst, legible, several
from rayproof.reports.results.headline import blamed_items
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.wrong_pixels import MOST_TIMES, stated_reason, wrong_pixels
from rayproof.reports.run.worker_tasks import CACHE, JUDGE
from rayproof.reports.subjects import TRACER

if TYPE_CHECKING:
    from rich.progress import Progress

COLOURS = {
    Outcome.PASS: "green",
    Outcome.WARN: "yellow",
    Outcome.UNDECIDED: "cyan",
    Outcome.UNSUPPORTED: "cyan",
    Outcome.MISSING: "magenta",
    Outcome.REFERENCE_SUSPECT: "blue",
    Outcome.ERROR: "red",
    Outcome.FAIL: "bold red",
}


# s without a line before a log reports the work in progress: if the work has changed, and if it has not
SOON, NOW_AND_THEN = 5.0, 20.0
NAME = 20  # columns of a terminal that a case's name gets at least
DOING = {JUDGE: "judging", TRACER: "tracing", CACHE: "looking up what is kept"}


def _bar(console: Console) -> "Progress":
    """Return a bar for a terminal; its modules are imported here, since a log has no bar."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console)


class CaseProgress:
    """Print the progress of a run."""

    def __init__(self, console: Console, *, total: int) -> None:
        self._console = console
        self._bar = _bar(console) if console.is_terminal else None
        self._task = None if self._bar is None else self._bar.add_task("cases", total=total)
        self._total = total
        self._done = 0
        # Time of the last line, and the workers in it.
        self._told: tuple[float, frozenset[str]] = (time.monotonic(), frozenset())

    def __enter__(self) -> "CaseProgress":
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def working(self, cases: Collection[str], busy: Mapping[str, float]) -> None:
        """Print the cases in progress and the busy workers with their times [s]; called about once a second.

        A log gets a line if the workers change, and from time to time while a case takes long.
        """
        doing = ", ".join(f"{_in_words(kind)} {seconds:.0f} s" for kind, seconds in busy.items() if seconds >= 1)
        if not doing:
            return
        text = legible(f"{next(iter(cases), '')}: {doing}" if len(cases) == 1 else doing)
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text)
        now, what = time.monotonic(), frozenset(busy)
        waited = now - self._told[0]
        if not self._console.is_terminal and waited > (SOON if what != self._told[1] else NOW_AND_THEN):
            self._told = now, what
            self._console.print(f"[{self._done}/{self._total}] {text}", soft_wrap=True, highlight=False)

    def finished(self, record: CaseRecord, *, again: bool) -> None:
        """Print a finished case; `again`: its record was resumed from an earlier run."""
        self._done += 1
        self._told = time.monotonic(), self._told[1]
        outcome = Outcome(record["verdict"])
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self._done, description=legible(record["name"]))
        if not self._console.is_terminal or outcome is not Outcome.PASS:
            how = "kept" if again else f"{record['seconds']:.2f} s"
            why = stated_reason(record)
            line = f"[{self._done}/{self._total}] {outcome.value} {record['name']} ({how}) {why}".rstrip()
            style = COLOURS[outcome] if self._console.is_terminal else None
            self._console.print(legible(line), style=style, soft_wrap=not self._console.is_terminal)


def _in_words(kind: str) -> str:
    """Return the activity of a kind of worker in words."""
    return DOING.get(kind) or kind.removeprefix("reference:").removeprefix("subject:")


def worst_first(records: Sequence[CaseRecord], *, most: int = 12) -> Table:
    """Return a table of the worst cases, by verdict and then by their largest error over its limit."""
    order = list(Outcome)

    def badness(record: CaseRecord) -> tuple[int, float]:
        worst = highest(record)
        return order.index(Outcome(record["verdict"])), worst[0] if worst else 0.0

    total = len(records)
    records = records.worst_first()[:most] if isinstance(records, Cases) else records
    table = Table(title=f"Worst {min(most, total)} of {several(total, 'case')}", title_justify="left")
    # A narrow terminal breaks names and items into lines: a name that is cut short names no case.
    for column in ("case", "verdict", "stage", "item", "wrong pixels", "worst error / limit"):
        table.add_column(column, overflow="fold", min_width=NAME if column == "case" else None)
    for record in sorted(records, key=badness, reverse=True)[:most]:
        ratio, where = highest(record) or (None, "")
        size = "" if ratio is None else f"{ratio:.3g}" if ratio < MOST_TIMES else f"over {MOST_TIMES:g}"
        outcome = Outcome(record["verdict"])
        table.add_row(
            record["name"],
            Text(outcome.value, style=COLOURS[outcome]),
            record["stage"] or "",
            blamed_items(record),
            wrong_pixels(record),
            f"{size}: {where}" if size else "",
        )
    return table


def highest(record: CaseRecord) -> tuple[float, str] | None:
    """Return a case's largest error over limit and the name of its check; None if nothing was measured."""
    ratios = [(at_worst(ratio), check.name) for check in record["checks"] if (ratio := ratio_of(check)) is not None]
    return max(ratios, default=None)
