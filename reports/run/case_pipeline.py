"""The pipeline of a case: rendered by subject and references, judged, recorded; and the cases in progress at once.

Several cases are in progress at once: enough that the other processors have references to render and cases to judge
while a series of cases keeps the subject busy, and few enough pixels that their answers, up to 2 KB per pixel, need
little memory. If a processor is idle because all cases wait for a slow or sleeping renderer, as many again are started.
"""

import pickle
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Protocol

from rayproof.cases.case import Case
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.repeated import add_note, repeated
from rayproof.reports.processes.pool import Coroutines, Future, Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import EngineRecord
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.case_answers import CaseAnswers, Render
from rayproof.reports.run.case_record import unjudged
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.plan import DEFAULTS, PlannedCase
from rayproof.reports.run.scenes import deadline, is_large
from rayproof.reports.run.verdict_memory import Memory
from rayproof.reports.run.worker_tasks import (
    CACHE,
    JUDGE,
    REFERENCE,
    cached_references,
    check_judge,
    compare_repeated,
    judge,
    kind_of,
    render_reference,
    render_subject,
    render_tracer,
)

LAUNCHES = 3  # of a kernel; its time is their median


@dataclass(kw_only=True)
class CaseWay:
    """One case in progress: `record` renders and judges it and returns its record; its files are in `folder`."""

    planned: PlannedCase
    options: CaseOptions
    pool: Pool
    folder: Path
    memory: Memory | None  # of earlier verdicts
    seconds: dict[str, float] = field(default_factory=dict)  # of each render, by renderer as the report names it
    launches: dict[str, tuple[float, int]] = field(default_factory=dict)  # of the tracer: median time [s], number
    growth: float = 0.0  # bytes of memory per scene, of a program that stays alive
    lost: list[str] = field(default_factory=list)  # the program that stays alive, if it died or exceeded a limit
    repeated: list[RepeatedRecord] = field(default_factory=list)  # of a case that is rendered twice
    first: Answers | None = None  # first answer of a persistent program, which renders the case again after all cases

    async def record(self) -> CaseRecord:
        """Render with the subject; reuse the verdict if nothing changed; render with the references; judge; record."""
        answers = await self.render_subject()
        key, record = self.earlier_verdict(answers)
        if record is not None:
            return self.recorded(record)
        answers = await self.render_references(answers)
        record = await self.judge(answers)
        if self.memory is not None and key is not None and flawless(record, answers.references):
            self.memory.keep(key, self.folder, record)
        return self.recorded(record)

    async def render_subject(self) -> CaseAnswers:
        """Render with the subject by each configuration; twice, if that is planned and the subject is not kept alive.

        Its renders are first: all else waits for the subject, which has one worker.
        """
        configurations = self.planned.configurations
        first = {name: self._submit_subject(name) for name in configurations}
        twice = self.planned.twice and not self.options.subject.stays
        second = {name: self._submit_subject(name, again=True) for name in configurations if twice}
        renders = {name: self._render(name, await reply) for name, reply in first.items()}
        again = {name: second_answers(name, await reply) for name, reply in second.items()}
        subjects = {name: render.answers for name, render in renders.items()}
        case = self.planned.case.name
        self.repeated = [repeated(case, subjects[name], again[name], None, varies=False) for name in again]
        self.first = subjects[configurations[0]] if self.planned.twice and not twice else None
        return CaseAnswers(
            subjects=tuple(subjects.values()),
            again=tuple(again.values()) if self._varied else (),
            versions={program: version for render in renders.values() for program, version in render.versions.items()},
            notes=renders[configurations[-1]].notes,
        )

    def earlier_verdict(self, answers: CaseAnswers) -> tuple[str | None, CaseRecord | None]:
        """Return the key of the verdict on the subject's answers, and the record that is stored under it, if any.

        There is no key without a cache, after an error, or if the subject's answers vary: their difference is judged
        in every run.
        """
        if (
            self.memory is None
            or self._varied
            or any(configuration.error is not None for configuration in answers.subjects)
        ):
            return None, None
        key = self.memory.key(self.planned.case, answers.subjects, answers.notes)
        record = self.memory.recall(key, self.folder)
        if record is not None:
            # Times, versions and cache flags describe this run.
            record["judge_seconds"] = 0.0
            record["remembered"] = True
            record["versions"] |= answers.versions
            for render in record["renders"]:
                render["cached"] = render["renderer"] not in self.seconds
        return key, record

    async def render_references(self, answers: CaseAnswers) -> CaseAnswers:
        """Add the answers of the panel, from the cache where it has them."""
        # Run the judge's self-tests while the references render; a second judge then finds the result.
        self.pool.prepare(JUDGE, partial(check_judge, cached=self.options.cached))
        case, cached, damaged = self.planned.case, dict[str, Render](), dict[str, str]()
        if self.options.cached:
            reply = await self._submit(CACHE, partial(cached_references, case, self.options))
            if reply.error is None:  # a cache that failed counts as empty
                cached, damaged = reply.value
        rendering = {
            name: self._submit(
                f"{REFERENCE}{name}",
                partial(render_reference, name, case.scene, case.samples, cached=self.options.cached),
            )
            for name in self.options.references
            if name not in cached
        }
        references, versions = [], dict(answers.versions)
        for name in self.options.references:
            if name in cached:
                render, self.seconds[name] = cached[name], 0.0
            else:
                reply = await rendering[name]
                render = self._render(name, reply)
                if name in damaged and reply.error is None:
                    mishaps = (damaged[name], *render.answers.mishaps)
                    render = replace(render, answers=replace(render.answers, mishaps=mishaps))
            references.append(render.answers)
            versions |= render.versions
        return replace(answers, references=tuple(references), versions=versions)

    async def judge(self, answers: CaseAnswers) -> CaseRecord:
        """Judge the answers; the record of a case that cannot be judged is an error."""
        case, options = self.planned.case, self.options
        # Judged before anything else is rendered: finished cases leave memory.
        reply = await self._submit(JUDGE, partial(judge, case, options, answers, self.folder), first=True)
        record = reply.value
        if reply.error is not None:
            about = {"folder": self.folder, "subject": options.subject}
            record = unjudged(case, answers.subjects, answers.references, reply, **about)
        # After a failed judgement, a difference between answers that are declared to vary proves nothing.
        unknown = [] if self._varied and options.subject.varies else self.repeated
        self.repeated = record.pop("repeated", unknown)
        record["judge_seconds"] = round(reply.seconds, 4)
        record["remembered"] = False
        record["versions"] = answers.versions
        return record

    def recorded(self, record: CaseRecord) -> CaseRecord:
        """Return the record with the times of this run's renders."""
        for render in record["renders"]:
            render["seconds"] = round(self.seconds.get(render["renderer"], 0.0), 4)
            if (timed := self.launches.get(render["renderer"])) is not None:
                render["kernels"], render["launches"] = float(f"{timed[0]:.4g}"), timed[1]
        if self.planned.twice:
            record["repeated"] = self.repeated
        if self.lost:
            record["lost"] = self.lost
        if self.growth:
            record["growth"] = round(self.growth)
        record["seconds"] = round(sum(self.seconds.values()) + record["judge_seconds"], 4)
        return record

    async def compare_again(self, record: CaseRecord, kept: Path) -> CaseRecord:
        """Render with the subject again; record the difference from the first answers, in the file `kept`."""
        case, name = self.planned.case, self.planned.configurations[0]
        again = second_answers(name, await self._submit_subject(name, again=True))
        first: Answers = pickle.loads(kept.read_bytes())
        kept.unlink()
        comparison = repeated(case.name, first, again, None, varies=False)
        if comparison["verdict"] == Outcome.FAIL and again.error is None:  # measure the difference
            varies = self.options.subject.varies
            reply = await self._submit(JUDGE, partial(compare_repeated, case, first, again, varies=varies))
            comparison = comparison if reply.error is not None else reply.value
        record["repeated"] = [comparison]
        add_note(record, comparison, self.options.subject.name)
        record["lost"] = [again.name] if again.lost else []
        return record

    @property
    def _varied(self) -> bool:
        """Return whether the subject's second answers differ from its first ones."""
        return any(comparison["verdict"] == Outcome.FAIL for comparison in self.repeated)

    @cached_property
    def _limit(self) -> float | None:
        """Return the time limit [s] of each task of the case, or None if the user has set a limit."""
        if not self.options.patient:
            return None
        about = {"configurations": len(self.planned.configurations), "references": len(self.options.references)}
        return deadline(self.planned.case, **about)

    @cached_property
    def _is_large(self) -> bool:
        """Return whether the scene takes much of the machine's memory."""
        return is_large(self.planned.case.scene)

    def _submit(
        self, kind: str, task: partial[Any], *, first: bool = False, seconds: float | None = None
    ) -> Future[Reply]:
        """Submit a task of the case; it may take `seconds`, by default the case's limit."""
        limit = self._limit if seconds is None else seconds
        return self.pool.submit(kind, task, first=first, seconds=limit, large=self._is_large)

    def _submit_subject(self, configuration: str, *, again: bool = False) -> Future[Reply]:
        """Submit a render of the subject; `again` marks a second render, which is not timed."""
        case, subject, limit = self.planned.case, self.options.subject, self._limit
        if subject.is_tracer:
            # The suite's further configurations are launched once: to repeat all took 5 % of the suite's time.
            usual = self.planned.configurations[: len(DEFAULTS)] == DEFAULTS
            launches = 1 if again or (usual and configuration not in DEFAULTS) else LAUNCHES
            task = partial(render_tracer, case, self.options, configuration, launches)
            return self._submit(kind_of(subject), task, first=True)
        if limit is not None:
            subject = replace(subject, seconds=max(subject.seconds, limit))
            # A program is stopped by its own limit, with a reason; the task may contain its start and two calls.
            limit = 4 * limit if subject.is_program else limit
        task = partial(render_subject, case.scene, case.samples, subject)
        return self._submit(kind_of(subject), task, first=True, seconds=limit)

    def _render(self, name: str, reply: Reply) -> Render:
        """Return the render of a configuration or reference, with an error if it failed, and note its time."""
        subject = self.options.subject
        is_subject = name in self.planned.configurations
        renderer = subject.renderer(name) if is_subject else name
        self.seconds[renderer] = reply.seconds
        if reply.error is not None:
            answers = Answers(
                name=name,
                precision=name.split("/")[0] if is_subject and subject.is_tracer else "float32",
                error=reply.error,
                stopped=reply.stopped,
                lost=is_subject and subject.stays,
            )
            render = Render(answers=answers, versions={})
        else:
            render = reply.value
        if render.launches is not None:
            self.launches[renderer] = render.launches
        if render.standing is not None:
            self.seconds[renderer] -= render.standing.start
            self.growth = render.standing.growth
        if render.answers.lost:
            self.lost.append(render.answers.name)
        return render


def second_answers(name: str, reply: Reply) -> Answers:
    """Return the answers of a second render."""
    return reply.value.answers if reply.error is None else Answers(name=name, precision="float32", error=reply.error)


def flawless(record: CaseRecord, references: tuple[Answers, ...]) -> bool:
    """Return whether a case had no error and no mishap, which might not occur in another run."""
    return record["verdict"] != Outcome.ERROR and not any(
        reference.error or reference.mishaps for reference in references
    )


class Engine(Protocol):
    """The processes that render and judge: this machine's pool (`LocalCases`) or a Dask cluster (`Dispatch`)."""

    @property
    def gone(self) -> str | None:
        """Return the reason why no more work can be done, or None."""
        ...

    @property
    def has_room(self) -> bool:
        """Return whether another case may be submitted."""
        ...

    @property
    def doing(self) -> Collection[str]:
        """Return the names of the cases in progress, if the engine knows them."""
        ...

    @property
    def busy(self) -> Mapping[str, float]:
        """Return the busy workers, each with the time [s] since its task began."""
        ...

    def submit(self, planned: PlannedCase) -> Future[CaseRecord]:
        """Submit a case, and return the future of its record."""
        ...

    def submit_again(self) -> dict[Future[CaseRecord], PlannedCase]:
        """Submit the finished cases that the subject is to render again, and return their futures."""
        ...

    def step(self) -> None:
        """Wait shortly for a result, and process it."""
        ...

    def close(self) -> None:
        """Stop the work in progress."""
        ...

    def record(self) -> EngineRecord | None:
        """Return the engine's part of results.json, or None for this machine."""
        ...


def finished(engine: Engine, cases: Iterable[PlannedCase]) -> Iterator[tuple[PlannedCase, CaseRecord] | None]:
    """Yield each case with its record when it is finished, and None before each step of the engine.

    Cases that the subject renders again are yielded a second time, at the end. It ends early if the engine is gone.
    """
    unread, under_way = iter(cases), dict[Future[CaseRecord], PlannedCase]()
    following = next(unread, None)
    while engine.gone is None:
        while following is not None and engine.has_room:
            under_way[engine.submit(following)] = following
            following = next(unread, None)
        under_way = under_way or engine.submit_again()
        if not under_way:
            return
        yield None
        engine.step()
        for future in [future for future in under_way if future.done()]:
            yield under_way.pop(future), future.result()


# Another case may start if fewer than AT_LEAST cases or fewer than PIXELS pixels are in progress; see the top.
AT_LEAST = 3
PIXELS = 2**17


class LocalCases:
    """The cases in progress in this machine's pool; their files are written to `folder`.

    A program that stays alive renders some cases again at the end.
    """

    gone = None  # this machine stays

    def __init__(self, options: CaseOptions, pool: Pool, *, folder: Path, store: Store | None) -> None:
        self._options, self._pool, self._folder = options, pool, folder
        self._memory = None if store is None else Memory(store, options)
        self._coroutines = Coroutines()
        self._pixels: dict[str, int] = {}  # by name
        self._again: list[tuple[CaseWay, CaseRecord, Path]] = []  # for a second render, with the file of the answers

    @property
    def has_room(self) -> bool:
        """Return whether another case may start."""
        pixels = self._pixels.values()
        return has_room(pixels) or (has_room(pixels, waiting=True) and self._pool.spare() > 0)

    @property
    def doing(self) -> list[str]:
        """Return the names of the cases in progress."""
        return list(self._pixels)

    @property
    def busy(self) -> dict[str, float]:
        """Return the kinds of the busy workers, each with the time [s] since its task began."""
        return self._pool.busy

    def submit(self, planned: PlannedCase) -> Future[CaseRecord]:
        """Submit a case, and return the future of its record."""
        self._pixels[planned.case.name] = _pixels(planned.case)
        return self._coroutines.start(self._finish(planned))

    async def _finish(self, planned: PlannedCase) -> CaseRecord:
        way = CaseWay(planned=planned, options=self._options, pool=self._pool, folder=self._folder, memory=self._memory)
        record = await way.record()
        del self._pixels[planned.case.name]
        if way.first is not None and way.first.error is None:
            with tempfile.NamedTemporaryFile(delete=False) as kept:  # for the second render; too large to hold
                pickle.dump(way.first, kept)
            self._again.append((way, record, Path(kept.name)))
        way.first = None
        return record

    def submit_again(self) -> dict[Future[CaseRecord], PlannedCase]:
        """Submit the stored cases for their second render, in reverse order."""
        again, self._again = self._again, []
        return {self._coroutines.start(self._finish_again(*entry)): entry[0].planned for entry in reversed(again)}

    async def _finish_again(self, way: CaseWay, record: CaseRecord, kept: Path) -> CaseRecord:
        self._pixels[way.planned.case.name] = 0
        record = await way.compare_again(record, kept)
        del self._pixels[way.planned.case.name]
        return record

    def step(self) -> None:
        """Wait shortly for a result, and process it."""
        self._pool.start()
        if self._memory is not None:
            self._memory.prepare()
        self._pool.step()
        self._coroutines.step()

    def close(self) -> None:
        """End the workers."""
        self._pool.close()

    def record(self) -> None:
        """Return None: results.json has no engine if this machine did the work."""


def has_room(pixels: Collection[int], *, waiting: bool = False) -> bool:
    """Return whether another case may start, from the pixels of each case in progress; `waiting`: all of them wait."""
    times = 2 if waiting else 1
    return len(pixels) < times * AT_LEAST or sum(pixels) < times * PIXELS


def _pixels(case: Case) -> int:
    """Return the number of pixels of a case's largest image, times the samples per pixel."""
    return case.scene.camera.width * case.scene.camera.height * case.samples**2
