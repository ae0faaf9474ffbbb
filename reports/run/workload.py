"""`execute`: the plan's cases through an engine into the journal, with resuming, interrupts, first failures.

The journal is results.sqlite. A case is committed when it finishes, so that a killed run loses none.
"""

import re
from array import array
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console

from rayproof.reports.program_name import called
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import NAME, Cases, CaseTable, DamagedTableError
from rayproof.reports.results.files import replacing
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.case_pipeline import Engine, finished
from rayproof.reports.run.case_record import reproduce
from rayproof.reports.run.options import RunOptions, case_options
from rayproof.reports.run.plan import PlannedCase, record_key
from rayproof.reports.run.progress import CaseProgress
from rayproof.reports.subjects import Subject


class Journal:
    """The finished cases in DIR/results.sqlite, with access by key."""

    def __init__(self, folder: Path, *, resume: bool) -> None:
        self._folder = folder
        path = folder / NAME
        if not resume:
            for name in (NAME, f"{NAME}-journal"):
                (folder / name).unlink(missing_ok=True)
        else:
            _mend(path)
        self._table, self._handed_over = CaseTable(path), False
        self._table.begin()

    def finished(self, key: str) -> CaseRecord | None:
        """Return the record of a case that was finished under exactly this key, or None.

        An error, or a reference that abstained, may have been the machine's or the time limit's fault, so that such a
        case is done again. So is a case whose images are gone, since they are searched for causes.
        """
        try:
            record = self._table.finished(key)
        except DamagedTableError:
            return None  # its case is simply done again
        if record is None or record.get("verdict") == Outcome.ERROR or record.get("abstained"):
            return None
        images = (render.get("image") for render in record.get("renders", ()))
        return record if all((self._folder / image).is_file() for image in images if image) else None

    def append(self, key: str, record: CaseRecord) -> None:
        """Write one finished case and make sure that it reached the disk."""
        self._table.keep(key, record)

    def together(self) -> AbstractContextManager[None]:
        """Commit the records that are appended in the body all at once: as safe as one by one, and faster."""
        return self._table.writing()

    def cases(self, keys: Iterable[str]) -> Cases:
        """Return the cases under these keys as the cases of the run, in this order; missing keys are skipped.

        The cases are read from the file, which stays open as long as they exist.
        """
        self._handed_over = True
        return self._table.arrange(keys)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        if not self._handed_over:
            self._table.close()


def _mend(path: Path) -> None:
    """Write a damaged file again with the records that can still be read."""
    if not path.is_file():
        return
    waiting = Path(f"{path}-journal")  # it must not be applied to the new file
    try:
        table = CaseTable(path)
    except DamagedTableError:
        path.unlink()
        waiting.unlink(missing_ok=True)
        return
    try:
        table.check()
    except DamagedTableError:
        waiting.unlink(missing_ok=True)
        _write(path, table.salvaged())
    finally:
        table.close()


def _write(path: Path, entries: Iterable[tuple[str, CaseRecord]]) -> None:
    with replacing(path) as draft:
        table = CaseTable(draft)
        try:
            with table.writing():
                for key, record in entries:
                    table.keep(key, record)
        finally:
            table.close()
            Path(f"{draft}-journal").unlink(missing_ok=True)


FIRST = 3  # calls of a program; if they fail alike, so will the rest
MOST_LOST = 3  # deaths or exceeded limits in a row, of a program that stays alive
_CHANGING = re.compile(r"\S*rayproof-\S*|\d+")  # a call's own folder, and numbers such as a process's


@dataclass(frozen=True)
class Recording:
    """The recording of cases that are finished or resumed: their keys, journal and progress."""

    request: RunOptions
    keys: Mapping[str, str]  # by the cases' names
    journal: Journal
    progress: CaseProgress
    calls: "FirstCalls"
    done: set[str] = field(default_factory=set)  # names

    def finished(self, planned_case: PlannedCase, record: CaseRecord) -> None:
        """Record a case that was just rendered and judged."""
        key = self.keys[planned_case.case.name]
        self.done.add(planned_case.case.name)
        record["key"] = key
        record["reproduce"] = self._reproduce(planned_case)
        self.journal.append(key, record)
        self.progress.finished(record, again=False)
        if self.request.subject.capabilities.refusal(planned_case.case.scene) is None:
            self.calls.finished(record)

    def amended(self, planned_case: PlannedCase, record: CaseRecord) -> None:
        """Record the result of a finished case's second render."""
        self.journal.append(self.keys[planned_case.case.name], record)
        self.calls.asked_again(record)

    def taken_up(self, planned_case: PlannedCase) -> bool:
        """Resume a case from the journal; return whether the journal contains it."""
        key = self.keys[planned_case.case.name]
        record = self.journal.finished(key)
        if record is None:
            return False
        self.done.add(planned_case.case.name)
        again = self._reproduce(planned_case)
        if record.get("reproduce") != again:  # a folder that was moved
            record["reproduce"] = again
            self.journal.append(key, record)
        self.progress.finished(record, again=True)
        return True

    def _reproduce(self, planned_case: PlannedCase) -> str:
        return reproduce(self.request.out, planned_case, self.request.subject)


@dataclass(frozen=True, kw_only=True)
class Execution:
    """The records of a run's cases, in the plan's order, and the reason if they are not complete."""

    records: Cases
    interrupted: bool  # by the user
    stopped: str | None  # the reason, in words, why the rest was not done


def execute(
    request: RunOptions,
    planned: Sequence[PlannedCase],
    references: tuple[str, ...],
    console: Console,
    engine: Engine,
) -> Execution:
    """Render and judge the cases, and store each record when it is finished.

    If the first calls of a program under test all fail alike, no further call is made. The engine is closed.
    """
    options = case_options(request, references)
    keys = {planned_case.case.name: record_key(planned_case, options).digest for planned_case in planned}
    interrupted, calls = False, FirstCalls(request.subject, len(planned))
    with (
        Journal(request.out, resume=request.resume) as journal,
        CaseProgress(console, total=len(planned)) as progress,
    ):
        recording = Recording(request, keys, journal, progress, calls)
        try:
            todo = array(
                "Q", (number for number, planned_case in enumerate(planned) if not recording.taken_up(planned_case))
            )
            for result in finished(engine, (planned[number] for number in todo)):
                if result is None:
                    progress.working(engine.doing, engine.busy)
                elif result[0].case.name in recording.done:
                    recording.amended(*result)
                else:
                    recording.finished(*result)
                if calls.hopeless is not None:
                    break
        except KeyboardInterrupt:
            interrupted = True
        finally:
            engine.close()
        records = journal.cases(key for name, key in keys.items() if name in recording.done)
    stopped = None
    if engine.gone is not None:
        stopped = f"{engine.gone}; {len(records)} of {len(planned)} cases are finished, go on with --resume"
    elif calls.hopeless is not None:
        stopped = f"{calls.hopeless}; `{called()} call CASE FOLDER` makes one call"
    return Execution(records=records, interrupted=interrupted, stopped=stopped)


class FirstCalls:
    """The first calls of a program, and whether they all failed with the same error; any other subject has no calls.

    For a program that stays alive its losses are counted in all calls.
    """

    def __init__(self, subject: Subject, planned: int) -> None:
        self._name = subject.name
        self._asked = subject.is_program and planned > FIRST  # in a plan of at most FIRST cases all calls are made
        self._said: list[str] = []
        self._lost = 0  # in a row
        self.hopeless: str | None = None  # the reason why no further call is made

    def finished(self, record: CaseRecord) -> None:
        """Add the result of a case."""
        self.asked_again(record)
        if not self._asked:
            return
        error = self._error(record)
        self._said.append("" if error is None else _CHANGING.sub("", error))
        self._asked = error is not None and len(self._said) < FIRST
        if error is not None and len(self._said) == FIRST and len({*self._said}) == 1:
            self.hopeless = self.hopeless or f"the first {FIRST} calls fail alike: {error}"

    def asked_again(self, record: CaseRecord) -> None:
        """Count how often a program that stays alive was lost in a row."""
        self._lost = self._lost + 1 if record.get("lost") else 0
        if self._lost >= MOST_LOST:
            why = self._error(record) or next((comparison["sentence"] for comparison in record.get("repeated", [])), "")
            self.hopeless = f"the program died or exceeded a limit {MOST_LOST} times in a row, without an answer: {why}"

    def _error(self, record: CaseRecord) -> str | None:
        renders = record["renders"]
        return next(
            (str(render["error"]) for render in renders if render["renderer"] == self._name and render["error"]), None
        )
