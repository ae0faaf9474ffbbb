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
    """Keep finished cases in DIR/results.sqlite, and give back those whose key still holds."""

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
        case is done again. So is a case whose images are gone, since a cause is sought in them.
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
        """Keep what is appended in the body all at once: as sure as one by one, and quicker."""
        return self._table.writing()

    def cases(self, keys: Iterable[str]) -> Cases:
        """Return the cases under these keys as those of the run, in this order; of keys that are missing there is none.

        They are read from the file, which stays open as long as they are there.
        """
        self._handed_over = True
        return self._table.arrange(keys)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        if not self._handed_over:
            self._table.close()


def _mend(path: Path) -> None:
    """Write a damaged file anew with what can still be read of it."""
    if not path.is_file():
        return
    waiting = Path(f"{path}-journal")  # which must not meet the new file
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
    """How a case is recorded when it is finished, or found finished: its key, journal and progress."""

    request: RunOptions
    keys: Mapping[str, str]  # by the cases' names
    journal: Journal
    progress: CaseProgress
    calls: "FirstCalls"
    done: set[str] = field(default_factory=set)  # names

    def finished(self, one: PlannedCase, record: CaseRecord) -> None:
        """Record a case that was just rendered and judged."""
        key = self.keys[one.case.name]
        self.done.add(one.case.name)
        record["key"] = key
        record["reproduce"] = self._reproduce(one)
        self.journal.append(key, record)
        self.progress.finished(record, again=False)
        if self.request.subject.capabilities.refusal(one.case.scene) is None:
            self.calls.finished(record)

    def amended(self, one: PlannedCase, record: CaseRecord) -> None:
        """Record what came of asking about a finished case again."""
        self.journal.append(self.keys[one.case.name], record)
        self.calls.asked_again(record)

    def taken_up(self, one: PlannedCase) -> bool:
        """Take up what the journal knows of a case; say whether it does."""
        key = self.keys[one.case.name]
        known = self.journal.finished(key)
        if known is None:
            return False
        self.done.add(one.case.name)
        again = self._reproduce(one)
        if known.get("reproduce") != again:  # a folder that was moved
            known["reproduce"] = again
            self.journal.append(key, known)
        self.progress.finished(known, again=True)
        return True

    def _reproduce(self, one: PlannedCase) -> str:
        return reproduce(self.request.out, one, self.request.subject)


@dataclass(frozen=True, kw_only=True)
class Execution:
    """The records of a run's cases, in the plan's order, and why there are no more of them."""

    records: Cases
    interrupted: bool  # by the user
    stopped: str | None  # in words why the rest was not done


def execute(
    request: RunOptions,
    planned: Sequence[PlannedCase],
    references: tuple[str, ...],
    console: Console,
    engine: Engine,
) -> Execution:
    """Have the cases rendered and judged, and keep each record when it is finished.

    Where the first calls of a program under test all fail alike, the rest is not made. The engine is closed.
    """
    options = case_options(request, references)
    keys = {one.case.name: record_key(one, options).digest for one in planned}
    interrupted, calls = False, FirstCalls(request.subject, len(planned))
    with (
        Journal(request.out, resume=request.resume) as journal,
        CaseProgress(console, total=len(planned)) as progress,
    ):
        recording = Recording(request, keys, journal, progress, calls)
        try:
            todo = array("Q", (number for number, one in enumerate(planned) if not recording.taken_up(one)))
            for each in finished(engine, (planned[number] for number in todo)):
                if each is None:
                    progress.working(engine.doing, engine.busy)
                elif each[0].case.name in recording.done:
                    recording.amended(*each)
                else:
                    recording.finished(*each)
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
    """The first calls of a program: whether they all failed, in the same words. Of one that stays alive every call.

    Any other subject has none.
    """

    def __init__(self, subject: Subject, planned: int) -> None:
        self._name = subject.name
        self._asked = subject.is_program and planned > FIRST  # of so few cases all are made
        self._said: list[str] = []
        self._lost = 0  # in a row
        self.hopeless: str | None = None  # why no call is made any more

    def finished(self, record: CaseRecord) -> None:
        """Take up what became of another case."""
        self.asked_again(record)
        if not self._asked:
            return
        error = self._error(record)
        self._said.append("" if error is None else _CHANGING.sub("", error))
        self._asked = error is not None and len(self._said) < FIRST
        if error is not None and len(self._said) == FIRST and len({*self._said}) == 1:
            self.hopeless = self.hopeless or f"the first {FIRST} calls fail alike: {error}"

    def asked_again(self, record: CaseRecord) -> None:
        """Take up whether a program that stays alive was lost."""
        self._lost = self._lost + 1 if record.get("lost") else 0
        if self._lost >= MOST_LOST:
            why = self._error(record) or next((one["sentence"] for one in record.get("repeated", [])), "")
            self.hopeless = f"the program died or exceeded a limit {MOST_LOST} times in a row, without an answer: {why}"

    def _error(self, record: CaseRecord) -> str | None:
        renders = record["renders"]
        return next((str(one["error"]) for one in renders if one["renderer"] == self._name and one["error"]), None)
