"""`CasesUnderWay`: cases on their way through the pool, from rendering by subject and references to the judge.

A few are on their way at once: so many that a stretch of cases that keep the subject busy leaves enough to ask and to
judge for the other processors, so few pixels that their answers, up to 2 KB a pixel, are small in memory. Where a
processor is idle, because all cases wait for a slow or sleeping renderer, as many again are started.
"""

import pickle
import tempfile
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from rayproof.cases.case import Case
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.repeated import add_note, repeated
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.case_record import unjudged
from rayproof.reports.run.messages import (
    JUDGE,
    RECALLING,
    GuardTask,
    JudgeTask,
    RecallTask,
    ReferenceTask,
    RepeatTask,
    SubjectTask,
    TracerTask,
    kind_of,
)
from rayproof.reports.run.options import EVERY_CASE, Demands, KeptImages
from rayproof.reports.run.plan import DEFAULTS, PlannedCase
from rayproof.reports.run.scenes import deadline, is_large
from rayproof.reports.run.verdict_memory import Memory
from rayproof.reports.subjects import THE_TRACER, TRACER, Subject

LAUNCHES = 3  # of a kernel, the median of which is its time
AGAIN = ", again"  # after a subject's name: its second answer


@dataclass(frozen=True, kw_only=True)
class Request:
    """A task for a worker of a kind; `first` puts it before everything else that waits for that kind."""

    kind: str
    task: Any
    first: bool = False


Replies = Mapping[str, Reply]  # by the name of who was asked
Steps = Generator[Mapping[str, Request], Replies, CaseRecord]


@dataclass(kw_only=True)
class Renders:
    """The answers of the renderers of a case, by their names."""

    subjects: dict[str, Answers]
    versions: dict[str, str]
    seconds: dict[str, float]  # by renderer, as the report names it
    notes: tuple[str, ...] = ()  # what the subject says of its answers
    growth: float = 0.0  # bytes of memory a scene, of a program that stays alive
    launches: dict[str, tuple[float, int]] = field(default_factory=dict)  # of the tracer: median time [s], how many


class CaseRun:
    """Collect a case's renders and have them judged; `finished` gets the record.

    Each render, and the judgement, may take `seconds`, where that is more than the pool's own limit.
    """

    def __init__(
        self,
        planned: PlannedCase,
        references: tuple[str, ...],
        pool: Pool,
        *,
        folder: Path,
        require: tuple[str, ...],
        subject: Subject = THE_TRACER,
        memory: Memory | None = None,
        own: tuple[str, ...] = (),
        copies: tuple[tuple[str, str], ...] = (),
        images: KeptImages = EVERY_CASE,
        seconds: float | None = None,
        finished: Callable[["CaseRun", CaseRecord], None],
    ) -> None:
        self.planned = planned
        self._references = references
        self._pool = pool
        self._folder = folder
        self._require = require
        self._subject = subject
        self._memory = memory
        self._copies = copies  # of the user's own formulas: their paths, and where they lie here
        self._own = own  # the user's own formulas, each with the SHA-256 of its file
        self._images = images
        self._limit, self._large = seconds, is_large(planned.case.scene)
        # Name of an answer -> who renders it: what is under test.
        self._asked = dict.fromkeys(planned.configurations, subject)
        self._finished = finished
        self._repeated: list[RepeatedRecord] = []
        self.first: Answers | None = None  # the answer of one that is asked again once all are answered

    def start(self) -> None:
        """Submit the renders of the one under test; what else is needed, what they are tells."""
        self._advance(self._steps(), None)

    def _advance(self, steps: Steps, replies: Replies | None) -> None:
        """Submit what the next step asks for; once everybody has replied the step after it gets the replies."""
        try:
            requests = next(steps) if replies is None else steps.send(replies)
        except StopIteration as end:
            self._finished(self, end.value)
            return
        found: dict[str, Reply] = {}

        def take(name: str, reply: Reply) -> None:
            found[name] = reply
            if len(found) == len(requests):
                self._advance(steps, found)

        for name, request in requests.items():
            seconds = self._limit
            if seconds is not None and self._subject.is_program and request.kind == kind_of(self._subject):
                seconds = 4 * seconds  # its own limit ends it, with a reason; it may start, and be called twice
            about = {"first": request.first, "seconds": seconds, "large": self._large}
            self._pool.submit(request.kind, request.task, partial(take, name), **about)
        if not requests:
            self._advance(steps, found)

    def _steps(self) -> Steps:
        """Ask who is under test, look for an earlier verdict on these very answers, ask the references, have it judged.

        Each `yield` hands out requests, and gets the replies under their names. The end is the case's record.
        """
        # Before what others are asked: all else waits for the one under test, which has one worker.
        requests = {name: self._render(name) for name in self._asked}
        twice = self.planned.twice and not self._subject.stays
        if twice:
            requests |= {f"{name}{AGAIN}": self._render(name, again=True) for name in self.planned.configurations}
        replies = yield requests
        renders = self._rendered(replies)
        if self.planned.twice and not twice:
            self.first = renders.subjects[self.planned.configurations[0]]
        again = tuple(self._second(name, replies) for name in self.planned.configurations if twice)
        self._repeated = [self._held_together(one, renders) for one in again]
        varied = any(one["verdict"] == Outcome.FAIL for one in self._repeated)
        key = None
        memory = None if varied else self._memory  # how far answers vary is judged afresh
        if memory is not None and all(one.error is None for one in renders.subjects.values()):
            key = memory.key(self.planned.case, list(renders.subjects.values()), renders.notes)
            record = memory.recall(key, self._folder)
            if record is not None:
                return self._recorded(self._recognised(record, renders), renders)
        # While the references render: a second judge then finds the sentinels judged.
        self._pool.prepare(JUDGE, GuardTask(cached=self._memory is not None))
        answers, damaged = {}, {}
        if self._memory is not None:
            recall = Request(kind=RECALLING, task=RecallTask(names=self._references, task=self._reference_task))
            reply = (yield {RECALLING: recall})[RECALLING]
            if reply.error is None:  # a cache that broke knows nothing
                known, damaged = reply.value
                answers = {
                    name: Reply(value=(reference, {name: version}), error=None, trace=None, seconds=0.0)
                    for name, (reference, version) in known.items()
                }
        answers |= yield {
            name: Request(kind=f"reference:{name}", task=self._reference_task)
            for name in self._references
            if name not in answers
        }
        references = self._witnesses(answers, damaged, renders)
        subjects = tuple(renders.subjects[name] for name in self.planned.configurations)
        task = JudgeTask(
            case=self.planned.case,
            subjects=subjects,
            references=references,
            versions=renders.versions,
            folder=self._folder,
            require=self._require,
            panel=self._references,
            subject=self._subject,
            notes=renders.notes,
            images=self._images,
            cached=self._memory is not None,
            again=again if varied else (),
        )
        # Judged before anything else is rendered: finished cases leave memory.
        reply = (yield {JUDGE: Request(kind=JUDGE, task=task, first=True)})[JUDGE]
        record = reply.value
        if reply.error is not None:
            about = (self.planned.case, subjects, references, reply)
            record = unjudged(*about, folder=self._folder, subject=self._subject)
        # Where nobody could judge how far answers vary, those that are declared to vary say nothing.
        unknown = [] if varied and self._subject.varies else self._repeated
        self._repeated = record.pop("repeated", unknown)
        record["judge_seconds"] = round(reply.seconds, 4)
        record["remembered"] = False
        record["versions"] = renders.versions
        if self._memory is not None and key is not None and flawless(record, references):
            self._memory.keep(key, self._folder, record)
        return self._recorded(record, renders)

    @property
    def _reference_task(self) -> ReferenceTask:
        case = self.planned.case
        return ReferenceTask(scene=case.scene, samples=case.samples, cached=self._memory is not None)

    def _render(self, configuration: str, *, again: bool = False) -> Request:
        """Return the request for the answers of one configuration, or of one who is only tried."""
        case, subject = self.planned.case, self._asked[configuration]
        if subject.is_tracer:
            # The suite's further configurations are launched once: to repeat all took 5 % of the suite's time.
            often = not again and (
                configuration in DEFAULTS or self.planned.configurations[: len(DEFAULTS)] != DEFAULTS
            )
            about = {"scene": case.scene, "configuration": configuration, "samples": case.samples}
            about["launches"] = LAUNCHES if often else 1
            return Request(kind=TRACER, task=TracerTask(**about, own=self._own, copies=self._copies), first=True)
        if self._limit is not None:
            subject = replace(subject, seconds=max(subject.seconds, self._limit))
        task = SubjectTask(scene=case.scene, samples=case.samples, subject=subject)
        return Request(kind=kind_of(subject), task=task, first=True)

    def _rendered(self, replies: Replies) -> Renders:
        """Return what those under test answered, in the plan's order."""
        found = Renders(subjects={}, versions={}, seconds={})
        for name, subject in self._asked.items():
            reply = replies[name]
            found.seconds[subject.renderer(name)] = reply.seconds
            if reply.error is not None:
                found.subjects[name] = Answers(
                    name=name,
                    precision=name.split("/")[0] if subject.is_tracer else "float32",
                    error=reply.error,
                    stopped=reply.stopped,
                    lost=subject.stays,
                )
                continue
            found.subjects[name], versions, *more = reply.value
            found.versions |= versions
            if subject == self._subject and more:
                found.notes = more[0]
            if subject.is_tracer:
                found.launches[subject.renderer(name)] = more[1]
            if subject.stays:
                found.seconds[name] -= more[1].start
                found.growth = more[1].growth
        return found

    def ask_again(self, done: Callable[[Reply], None]) -> None:
        """Ask the one under test once more; `done` gets its reply."""
        request = self._render(self.planned.configurations[0], again=True)
        seconds = None if self._limit is None else 4 * self._limit
        self._pool.submit(request.kind, request.task, done, seconds=seconds, large=self._large)

    def _second(self, name: str, replies: Replies) -> Answers:
        """Return what one configuration answered when it was asked again."""
        return second_answer(name, replies[f"{name}{AGAIN}"])

    def _held_together(self, again: Answers, renders: Renders) -> RepeatedRecord:
        """Return whether a second answer is the first to the last bit."""
        return repeated(self.planned.case.name, renders.subjects[again.name], again, None, varies=False)

    def _witnesses(self, answers: Replies, damaged: Mapping[str, str], renders: Renders) -> tuple[Answers, ...]:
        """Return the references in the plan's order; `damaged` says of whom a kept render could not be read, and why.

        Their versions and times are added to what `renders` knows.
        """
        references = []
        for name in self._references:
            reply = answers[name]
            renders.seconds[name] = reply.seconds
            if reply.error is not None:
                references.append(Answers(name=name, precision="float32", error=reply.error, stopped=reply.stopped))
                continue
            reference, versions = reply.value
            if name in damaged:
                reference = replace(reference, mishaps=(damaged[name], *reference.mishaps))
            references.append(reference)
            renders.versions |= versions
        return tuple(references)

    def _recognised(self, record: CaseRecord, renders: Renders) -> CaseRecord:
        """Return the record of an earlier verdict; only what this run did itself is this run's."""
        record["judge_seconds"] = 0.0
        record["remembered"] = True
        record["versions"] |= renders.versions
        for render in record["renders"]:
            render["cached"] = render["renderer"] not in renders.seconds
        return record

    def _recorded(self, record: CaseRecord, renders: Renders) -> CaseRecord:
        """Return the record with the times of this run's renders."""
        for render in record["renders"]:
            render["seconds"] = round(renders.seconds.get(render["renderer"], 0.0), 4)
            if (timed := renders.launches.get(render["renderer"])) is not None:
                render["kernels"], render["launches"] = float(f"{timed[0]:.4g}"), timed[1]
        if self.planned.twice:
            record["repeated"] = self._repeated
        if lost := [one.name for one in renders.subjects.values() if one.lost]:
            record["lost"] = lost
        if renders.growth:
            record["growth"] = round(renders.growth)
        record["seconds"] = round(sum(renders.seconds.values()) + record["judge_seconds"], 4)
        return record


def second_answer(name: str, reply: Reply) -> Answers:
    """Return what the one under test answered when it was asked again."""
    return reply.value[0] if reply.error is None else Answers(name=name, precision="float32", error=reply.error)


def flawless(record: CaseRecord, references: tuple[Answers, ...]) -> bool:
    """Say whether nothing happened to a case that would not happen again."""
    return record["verdict"] != Outcome.ERROR and not any(one.error or one.mishaps for one in references)


# Cases on their way at once: so many that a stretch of cases that take the one under test long leaves enough to ask and
# to judge for the other processors, so few pixels that what they were answered, up to 2 KB each, is small in memory.
# Where a processor has nothing to do, because all of them wait for who is slow or sleeps, as many again.
AT_LEAST = 3
PIXELS = 2**17


@dataclass(frozen=True, kw_only=True)
class Source:
    """A user's own file with what it imports from beside it: the path that he wrote, and the contents by name."""

    path: str
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Instructions:
    """How each case of a run is put to the test, wherever that is done: plain data that travels between machines."""

    demands: Demands
    subject: Subject
    cached: bool  # what was answered and found before may be taken from the cache
    sources: tuple[Source, ...] = ()  # the user's own formulas, for machines that have not got them
    copies: tuple[tuple[str, str], ...] = ()  # there: the path of each, and where it lies
    patient: bool  # a case whose size is estimated to take longer than the pool's limit has longer


class CasesUnderWay:
    """Start cases and step the pool; `finished` gets each planned case and its record, whose files are in `folder`.

    Of a program that stays alive some are asked again at the end: `amended` gets their records once more.
    """

    def __init__(
        self,
        instructions: Instructions,
        pool: Pool,
        *,
        folder: Path,
        store: Store | None,
        finished: Callable[[PlannedCase, CaseRecord], None],
        amended: Callable[[PlannedCase, CaseRecord], None],
    ) -> None:
        self._instructions, self._pool, self._folder = instructions, pool, folder
        self._finished, self._amended = finished, amended
        self._first: list[tuple[CaseRun, CaseRecord, Path]] = []  # answered, and to be asked again
        self.asked_again: set[str] = set()  # names of cases under way for the second time
        self._memory = None if store is None else Memory(store, instructions.demands)
        self._pixels: dict[str, int] = {}  # by name

    @property
    def has_room(self) -> bool:
        """Say whether another case may start."""
        pixels = self._pixels.values()
        return has_room(pixels) or (has_room(pixels, waiting=True) and self._pool.spare() > 0)

    @property
    def doing(self) -> list[str]:
        """Return the names of the cases."""
        return list(self._pixels)

    def start(self, one: PlannedCase) -> None:
        """Send a case on its way."""
        self._pixels[one.case.name] = _pixels(one.case)
        self._run(one, seconds=self._patience(one)).start()

    def step(self) -> None:
        """Wait a little for something to happen, and take it up."""
        self._pool.start()
        if self._memory is not None:
            self._memory.prepare()
        self._pool.step()

    def _run(self, planned: PlannedCase, *, seconds: float | None) -> CaseRun:
        demands = self._instructions.demands
        return CaseRun(
            planned,
            demands.references,
            self._pool,
            folder=self._folder,
            require=demands.require,
            subject=self._instructions.subject,
            memory=self._memory,
            own=demands.own,
            copies=self._instructions.copies,
            images=demands.images,
            seconds=seconds,
            finished=self._done,
        )

    def _done(self, run: CaseRun, record: CaseRecord) -> None:
        del self._pixels[run.planned.case.name]
        if run.first is not None and run.first.error is None:
            with tempfile.NamedTemporaryFile(delete=False) as kept:  # until it was asked again; too large to hold
                pickle.dump(run.first, kept)
            self._first.append((run, record, Path(kept.name)))
        run.first = None
        self._finished(run.planned, record)

    def ask_again(self) -> None:
        """Ask about the cases that are kept for it once more, in another order."""
        while self._first:
            run, record, kept = self._first.pop()
            self.asked_again.add(run.planned.case.name)
            run.ask_again(partial(self._hold, run.planned, record, kept))

    def _hold(self, planned: PlannedCase, record: CaseRecord, kept: Path, reply: Reply) -> None:
        """Hold a second answer against the first; where they differ the judge says by how much."""
        first: Answers = pickle.loads(kept.read_bytes())
        kept.unlink()
        again, varies = second_answer(first.name, reply), self._instructions.subject.varies
        found = repeated(planned.case.name, first, again, None, varies=False)

        def amend(reply: Reply) -> None:
            record["repeated"] = [found if reply.error is not None else reply.value]
            add_note(record, record["repeated"][0], self._instructions.subject.name)
            record["lost"] = [again.name] if again.lost or reply.error is not None else []
            self.asked_again.discard(planned.case.name)
            self._amended(planned, record)

        if found["verdict"] == Outcome.FAIL and again.error is None:
            task = RepeatTask(case=planned.case, first=first, again=again, varies=varies)
            self._pool.submit(JUDGE, task, amend, seconds=self._patience(planned))
        else:
            amend(replace(reply, value=found, error=None))

    def _patience(self, planned: PlannedCase) -> float | None:
        """Return how long each task of a case may take, or None where the user said."""
        if not self._instructions.patient:
            return None
        references = len(self._instructions.demands.references)
        return deadline(planned.case, configurations=len(planned.configurations), references=references)


def has_room(pixels: Collection[int], *, waiting: bool = False) -> bool:
    """Say whether another case may start beside those under way, which have so many pixels each, or all wait."""
    times = 2 if waiting else 1
    return len(pixels) < times * AT_LEAST or sum(pixels) < times * PIXELS


def _pixels(case: Case) -> int:
    """Return how many pixels a case's largest image has, samples included."""
    return case.scene.camera.width * case.scene.camera.height * case.samples**2
