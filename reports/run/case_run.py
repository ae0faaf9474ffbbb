"""One case on its way through the pool: rendered by everyone, then judged, then recorded."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rayproof.reports.judge.renderers import Candidate, Witness
from rayproof.reports.paths.choice import asked
from rayproof.reports.paths.verdict import held_together, together
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, ConsistencyRecord
from rayproof.reports.run.messages import GuardTask, JudgeTask, RecallTask, ReferenceTask, SubjectTask, TracerTask
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.record.reproducing import reproduce
from rayproof.reports.run.record.unjudged import unjudged
from rayproof.reports.run.size import is_large
from rayproof.reports.run.tasks.kinds import JUDGE, RECALLING, UNDER_TEST
from rayproof.reports.run.verdict_memory import Memory
from rayproof.reports.subjects import PROGRAM, THE_TRACER, TRACER, Subject
from rayproof.reports.subjects.keeping import FOLDER as CALLS
from rayproof.reports.subjects.keeping import Keep


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
        full: bool = False,
        certified: bool = False,
        seconds: float | None = None,
        finished: Callable[["CaseRun", CaseRecord], None],
    ) -> None:
        self.planned = planned
        self.versions: dict[str, str] = {}
        self._references = references
        self._pool = pool
        self._folder = folder
        self._require = require
        self._subject = subject
        self._memory = memory
        self._own = own  # the user's own formulas, each with the SHA-256 of its file
        self._key: str | None = None
        self._damaged: dict[str, str] = {}  # what is told of references whose kept render was damaged
        self._notes: tuple[str, ...] = ()
        self._consistency: dict[str, list[ConsistencyRecord]] = {}  # by configuration
        self._paths: dict[str, dict[str, list[str]]] = {}  # by configuration: path -> routes
        self._full = full
        self._certified = certified
        self._limit, self._large = seconds, is_large(planned.case.scene)
        # Candidate -> who renders it: what is under test, and then those who are only tried.
        self._asked = dict.fromkeys(planned.configurations, subject)
        self._asked |= {trial.name: trial.subject for trial in planned.trials}
        self._finished = finished
        self._candidates: dict[str, Candidate] = {}
        self._witnesses: dict[str, Witness] = {}
        self._seconds: dict[str, float] = {}

    def start(self) -> None:
        """Submit the renders of the one under test; what else is needed, what they are tells."""
        for name, subject in self._asked.items():
            kind, task = self._task(name, subject)
            # Before what others are asked: all else waits for the one under test, which has one worker.
            self._submit(kind, task, lambda reply, name=name: self._traced(name, reply), first=True)

    def _compare(self) -> None:
        """Take up what was found of these very answers before, or have them judged."""
        candidates = [self._candidates[name] for name in self._asked]
        if self._memory is not None and all(candidate.error is None for candidate in candidates):
            self._key = self._memory.key(self.planned.case, candidates, self._notes)
            record = self._memory.recall(self._key, self._folder)
            if record is not None:
                self._recognised(record)
                return
        # While the references render: a second judge then finds the sentinels judged.
        self._pool.prepare(JUDGE, GuardTask(cached=self._memory is not None))
        if self._memory is None:
            self._ask(self._references)
        else:
            task = RecallTask(names=self._references, task=self._reference_task)
            self._submit(RECALLING, task, self._recalled)

    @property
    def _reference_task(self) -> ReferenceTask:
        case = self.planned.case
        return ReferenceTask(scene=case.scene, samples=case.samples, cached=self._memory is not None)

    def _recalled(self, reply: Reply) -> None:
        """Take what the cache knows, and ask the references for the rest; a cache that broke knows nothing."""
        known, self._damaged = reply.value if reply.error is None else ({}, {})
        self._ask(tuple(name for name in self._references if name not in known))
        for name, (witness, version) in known.items():
            self._referred(name, Reply(value=(witness, {name: version}), error=None, trace=None, seconds=0.0))

    def _ask(self, references: tuple[str, ...]) -> None:
        for name in references:
            self._submit(
                f"reference:{name}", self._reference_task, lambda reply, name=name: self._referred(name, reply)
            )

    def _submit(self, kind: str, task: Any, done: Callable[[Reply], None], *, first: bool = False) -> None:
        seconds = self._limit
        if seconds is not None and kind == PROGRAM:  # its own limit ends it, with a reason; it may be called twice
            seconds = 3 * seconds
        self._pool.submit(kind, task, done, first=first, seconds=seconds, large=self._large)

    def _task(self, configuration: str, subject: Subject) -> tuple[str, TracerTask | SubjectTask]:
        """Return the kind of worker that renders for a subject, and its task."""
        case = self.planned.case
        if subject.is_tracer:
            routes = asked(self.planned.routes, configuration)
            about = {"scene": case.scene, "configuration": configuration, "samples": case.samples, "routes": routes}
            return TRACER, TracerTask(**about, own=self._own)
        if self._limit is not None:
            subject = replace(subject, seconds=max(subject.seconds, self._limit))
        kept = subject.name == PROGRAM == self._subject.name
        keep = Keep(folder=self._folder / CALLS / case.name) if kept else None
        task = SubjectTask(scene=case.scene, samples=case.samples, case=case.name, subject=subject, keep=keep)
        return subject.name if subject.name == PROGRAM else f"{UNDER_TEST}{subject.name}", task

    def _traced(self, name: str, reply: Reply) -> None:
        subject = self._asked[name]
        if reply.error is None:
            self._candidates[name], versions, *more = reply.value
            if subject == self._subject:
                self._notes = more[0] if more else ()
            if len(more) > 1:
                self._consistency[name] = more[1]
                self._paths[name] = more[2]
            self.versions |= versions
        else:
            self._candidates[name] = Candidate(
                name=name,
                precision=name.split("/")[0] if subject.is_tracer else "float32",
                items=frozenset(),
                shadow_epsilon=0.0,
                answers=None,
                error=reply.error,
            )
        self._seconds[subject.renderer(name)] = reply.seconds
        if len(self._candidates) == len(self._asked):
            self._compare()

    def _referred(self, name: str, reply: Reply) -> None:
        if reply.error is None:
            witness, versions = reply.value
            if name in self._damaged:
                witness = replace(witness, mishaps=(self._damaged[name], *witness.mishaps))
            self._witnesses[name] = witness
            self.versions |= versions
        else:
            self._witnesses[name] = Witness(
                name=name,
                precision="float32",
                independent=False,
                shadow_epsilon=0.0,
                answers={},
                error=reply.error,
            )
        self._seconds[name] = reply.seconds
        if len(self._witnesses) == len(self._references):
            task = JudgeTask(
                case=self.planned.case,
                candidates=self._everybody[0],
                witnesses=self._everybody[1],
                versions=self.versions,
                folder=self._folder,
                require=self._require,
                panel=self._references,
                subject=self._subject,
                notes=self._notes,
                full=self._full,
                cached=self._memory is not None,
                certified=self._certified,
                trials=tuple(self._candidates[trial.name] for trial in self.planned.trials),
            )
            # Judged before anything else is rendered: finished cases leave memory.
            self._submit(JUDGE, task, self._judged, first=True)

    @property
    def _everybody(self) -> tuple[tuple[Candidate, ...], tuple[Witness, ...]]:
        """Return the parties in the plan's order, whoever answered first."""
        candidates = tuple(self._candidates[name] for name in self.planned.configurations)
        return candidates, tuple(self._witnesses[name] for name in self._references)

    def _judged(self, reply: Reply) -> None:
        record = reply.value
        if reply.error is not None:
            about = (self.planned.case, *self._everybody, reply)
            record = unjudged(*about, folder=self._folder, subject=self._subject)
        record["judge_seconds"] = round(reply.seconds, 4)
        record["remembered"] = False
        record["versions"] = self.versions
        if self._memory is not None and self._key is not None and self._flawless(record):
            self._memory.keep(self._key, self._folder, record)
        self._finish(record)

    def _flawless(self, record: CaseRecord) -> bool:
        """Say whether nothing happened that would not happen again."""
        witnesses = self._witnesses.values()
        return record["verdict"] != Outcome.ERROR and not any(one.error or one.mishaps for one in witnesses)

    def _recognised(self, record: CaseRecord) -> None:
        """Finish with what was found before; only what this run did itself is this run's."""
        record["judge_seconds"] = 0.0
        record["remembered"] = True
        record["versions"] |= self.versions
        record["reproduce"] = reproduce(self._folder, self.planned.case, self.planned.configurations, self._subject)
        for render in record["renders"]:
            render["cached"] = render["renderer"] not in self._seconds
        self._finish(record)

    def _finish(self, record: CaseRecord) -> None:
        for render in record["renders"]:
            render["seconds"] = round(self._seconds.get(render["renderer"], 0.0), 4)
        record["paths"] = together(self._paths.values())
        held_together(record, [one for name in self._asked for one in self._consistency.get(name, ())])
        record["seconds"] = round(sum(self._seconds.values()) + record["judge_seconds"], 4)
        self._finished(self, record)
