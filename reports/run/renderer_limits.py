"""The limits of a whole renderer: the last value of each scene ladder that it passes.

Every value is rendered and judged as a case of a run, in worker processes, by the closed forms and by certified
numbers. No other renderer judges, since each of them has limits of its own at such scenes.
"""

import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path

from rayproof.cases.ladders.whole_scenes import SCENE_LADDERS, SceneLadder
from rayproof.reports.diagnosis.blaming import by_stages
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.processes.pool import Future, Pool
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.case_pipeline import LocalCases
from rayproof.reports.run.options import CaseOptions, KeptImages
from rayproof.reports.run.plan import DEFAULTS, panel, plan
from rayproof.reports.run.workers import RELIEF, workers
from rayproof.reports.studies.stability.limit_records import LimitRecord, RungVerdict, ScaleRecord
from rayproof.reports.subjects import THE_TRACER, TRACER, Subject

JUDGES = (ORACLE, "certified")
MOST_RENDERS = 6  # of a ladder, unless all of its values are rendered
PASSED = (Outcome.PASS, Outcome.WARN)
UNANSWERED = (Outcome.ERROR, Outcome.MISSING, Outcome.UNSUPPORTED)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A renderer whose limits are measured: a subject, with a configuration if it is the tracer."""

    subject: Subject
    configuration: str

    @property
    def title(self) -> str:
        """Return its name in tables."""
        return f"{TRACER} {self.configuration}" if self.subject.is_tracer else self.subject.title


@dataclass(frozen=True, kw_only=True)
class SceneRung:
    """The result at one value of a ladder."""

    outcome: Outcome
    stage: str = ""
    items: tuple[str, ...] = ()  # of the specification, that may be to blame
    reason: str = ""

    @property
    def passes(self) -> bool:
        """Return whether the renderer passes at this value."""
        return self.outcome in PASSED


@dataclass(kw_only=True)
class SceneClimb:
    """The results of one renderer at the values of a ladder, by the value's index, and the choice of the next value."""

    ladder: SceneLadder
    rungs: dict[int, SceneRung] = field(default_factory=dict)
    answered: frozenset[str] = frozenset()  # the stages that have an answer at the first value

    def following(self) -> int | None:
        """Return the index of the value to render next, or None if the limit is known.

        Both ends are rendered first. Then the limit is bisected, and the remaining renders search for a value whose
        verdict is out of order. If there is such a value, or the ladder is a control, all values are rendered. If the
        first value has no answer, no other value is rendered.
        """
        last = len(self.ladder.values) - 1
        if 0 in self.rungs and self.rungs[0].outcome in UNANSWERED:
            return None
        if self.whole:
            return next((rung for rung in range(last + 1) if rung not in self.rungs), None)
        for end in (0, last):
            if end not in self.rungs:
                return end
        if len(self.rungs) >= MOST_RENDERS:
            return None
        indices = sorted(self.rungs)
        gaps = [pair for pair in pairwise(indices) if pair[1] - pair[0] > 1]
        # Bisect between a value that passes and the next, which does not; without such a pair bisect the widest gap.
        low, high = max(
            gaps,
            key=lambda gap: (self.rungs[gap[0]].passes != self.rungs[gap[1]].passes, gap[1] - gap[0]),
            default=(0, 0),
        )
        return (low + high) // 2 if high else None

    @property
    def whole(self) -> bool:
        """Return whether all values are to be rendered."""
        return self.ladder.control or not self.monotone

    @property
    def monotone(self) -> bool:
        """Return whether no value passes beyond a value that does not."""
        passes = [self.rungs[rung].passes for rung in sorted(self.rungs)]
        return passes == sorted(passes, reverse=True)

    def take(self, rung: int, record: CaseRecord, *, ran: bool) -> None:
        """Store the result at a value. A result with fewer answered stages than at the first value does not pass.

        `ran`: the items that the renderer's formulas cover are known.
        """
        outcome = Outcome(record["verdict"])
        checks = [check for check in record.get("checks", []) if check.reference == ORACLE]
        lacking = {check.stage: check.reason for check in checks if check.outcome == Outcome.UNSUPPORTED}
        if rung == 0:
            self.answered = frozenset(check.stage for check in checks) - lacking.keys()
        reason, stage = str(record.get("reason") or ""), str(record.get("stage") or "")
        broken = any(render.get("error") for render in record.get("renders", []))
        if outcome is Outcome.REFERENCE_SUSPECT or (outcome is Outcome.ERROR and not broken):
            outcome = Outcome.UNDECIDED  # the judges differ, or cannot judge the renderer
        lost = [name for name in lacking if name in self.answered]
        if outcome in PASSED and lost:
            outcome, stage, reason = Outcome.UNSUPPORTED, lost[0], str(lacking[lost[0]])
        blamed = by_stages(record, ran=ran)
        items = () if blamed is None else blamed.items
        self.rungs[rung] = SceneRung(outcome=outcome, stage=stage, items=items, reason=reason)

    def limit(self, renderer: str) -> LimitRecord:
        """Return the record of the limit."""
        values, indices = self.ladder.values, sorted(self.rungs)
        broken = next((rung for rung in indices if not self.rungs[rung].passes), None)
        reached = [rung for rung in indices if broken is None or rung < broken]
        result = SceneRung(outcome=Outcome.PASS) if broken is None else self.rungs[broken]
        return LimitRecord(
            renderer=renderer,
            ladder=self.ladder.name,
            limit=values[reached[-1]] if reached else None,
            breaks_at=None if broken is None else values[broken],
            verdict=result.outcome.value,
            stage=result.stage,
            items=list(result.items),
            reason=result.reason,
            monotone=self.monotone,
            rungs=[RungVerdict(value=values[rung], verdict=self.rungs[rung].outcome.value) for rung in indices],
        )


def scale(ladder: SceneLadder) -> ScaleRecord:
    """Return the record of a ladder: its quantity, unit and values."""
    return ScaleRecord(
        ladder=ladder.name,
        quantity=ladder.quantity,
        unit=ladder.unit,
        values=list(ladder.values),
        control=ladder.control,
    )


def ladders_named(patterns: Sequence[str]) -> list[SceneLadder]:
    """Return the ladders that fit a pattern, all without any.

    Raises:
        LookupError: a pattern fits none; the message lists the known names.

    """
    for pattern in patterns:
        if not any(fnmatchcase(ladder.name, pattern) for ladder in SCENE_LADDERS):
            names = ", ".join(ladder.name for ladder in SCENE_LADDERS)
            raise LookupError(f"no ladder of scenes is called {pattern!r}; known: {names}")
    return [
        ladder for ladder in SCENE_LADDERS if not patterns or any(fnmatchcase(ladder.name, name) for name in patterns)
    ]


def columns(subject: Subject, *, alone: bool) -> list[Column]:
    """Return the renderers to measure: the subject, followed by the tracer and the references if they are wanted."""
    renderers = [Column(subject=subject, configuration=DEFAULTS[0] if subject.is_tracer else subject.name)]
    if alone:
        return renderers
    renderers += [Column(subject=THE_TRACER, configuration=name) for name in DEFAULTS]
    names = [name for name in panel((), subject).names if name != ORACLE]
    renderers += [Column(subject=Subject(name=name, title=name), configuration=name) for name in names]
    return list({column.title: column for column in renderers}.values())


def measure(
    renderers: Sequence[Column],
    ladders: Sequence[SceneLadder],
    *,
    jobs: int,
    seconds: float,
    finished: Callable[[Column, SceneClimb], None] = lambda column, climb: None,
) -> Iterator[LimitRecord]:
    """Yield the limit of each renderer on each ladder, renderer by renderer."""
    pool = workers(renderers[0].subject, jobs=jobs, timeout=seconds)
    pool.relief = RELIEF
    try:
        for column in renderers:
            climbs = [SceneClimb(ladder=ladder) for ladder in ladders]
            with tempfile.TemporaryDirectory(prefix="rayproof-limits-") as folder:
                _climb(column, climbs, pool, Path(folder), lambda climb, of=column: finished(of, climb))
            yield from (climb.limit(column.title) for climb in climbs)
    finally:
        pool.close()


def _climb(
    column: Column,
    climbs: Sequence[SceneClimb],
    pool: Pool,
    folder: Path,
    finished: Callable[[SceneClimb], None],
) -> None:
    """Render several ladders at once, each one value at a time."""
    subject = column.subject
    judges = tuple(
        name for name in panel(("certified",) if subject.name != "certified" else (), subject).names if name in JUDGES
    )
    store = usual_store()
    if store.unused is None:
        store.begin()
    options = CaseOptions(subject=subject, references=judges, images=KeptImages(0.0), cached=store.unused is None)
    engine = LocalCases(options, pool, folder=folder, store=store if options.cached else None)
    ready, under_way = deque(climbs), dict[Future[CaseRecord], tuple[SceneClimb, int]]()
    while ready or under_way:
        while ready and engine.has_room:
            climb = ready.popleft()
            rung = climb.following()
            assert rung is not None
            (planned,) = plan((climb.ladder.case(rung),), (column.configuration,), subject)
            under_way[engine.submit(planned)] = (climb, rung)
        engine.step()
        for future in [future for future in under_way if future.done()]:
            climb, rung = under_way.pop(future)
            climb.take(rung, future.result(), ran=subject.is_tracer)
            (ready.appendleft if climb.following() is not None else finished)(climb)
