"""One case on its way through the pool: rendered by everyone, then judged, then recorded."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from reports.judge.oracle import stages_of
from reports.judge.outcomes import Outcome
from reports.judge.parties import Candidate, Witness
from reports.run.orders import JudgeTask, ReferenceTask, SubjectTask, TracerTask
from reports.run.plan import PlannedCase
from reports.run.pool import Pool
from reports.run.reproducing import reproduce, write_scene
from reports.run.tasks import UNDER_TEST
from reports.run.worker import Reply
from reports.subjects import PROGRAM, THE_TRACER, TRACER, Subject


class CaseRun:
    """Collect a case's renders and have them judged; `finished` gets the record."""

    def __init__(
        self,
        planned: PlannedCase,
        references: tuple[str, ...],
        pool: Pool,
        *,
        folder: Path,
        require: tuple[str, ...],
        subject: Subject = THE_TRACER,
        cached: bool = True,
        full: bool = False,
        finished: Callable[["CaseRun", dict[str, Any]], None],
    ) -> None:
        self.planned = planned
        self.versions: dict[str, str] = {}
        self._references = references
        self._pool = pool
        self._folder = folder
        self._require = require
        self._subject = subject
        self._cached = cached
        self._notes: tuple[str, ...] = ()
        self._full = full
        self._finished = finished
        self._candidates: dict[str, Candidate] = {}
        self._witnesses: dict[str, Witness] = {}
        self._seconds: dict[str, float] = {}

    def start(self) -> None:
        """Submit every render of the case."""
        case = self.planned.case
        for name in self.planned.configurations:
            kind, task = self._task(name)
            self._pool.submit(kind, task, lambda reply, name=name: self._traced(name, reply))
        for name in self._references:
            task = ReferenceTask(scene=case.scene, samples=case.samples, cached=self._cached)
            self._pool.submit(f"reference:{name}", task, lambda reply, name=name: self._referred(name, reply))

    def _task(self, configuration: str) -> tuple[str, TracerTask | SubjectTask]:
        """Return the kind of worker that renders for the subject, and its task."""
        case = self.planned.case
        if self._subject.is_tracer:
            return TRACER, TracerTask(scene=case.scene, configuration=configuration, samples=case.samples)
        task = SubjectTask(scene=case.scene, samples=case.samples, case=case.name, subject=self._subject)
        return self._subject.name if self._subject.name == PROGRAM else f"{UNDER_TEST}{self._subject.name}", task

    def _traced(self, name: str, reply: Reply) -> None:
        if reply.error is None:
            self._candidates[name], versions, *notes = reply.value
            self._notes = notes[0] if notes else ()
            self.versions |= versions
        else:
            self._candidates[name] = Candidate(
                name=name,
                precision=name.split("/")[0] if self._subject.is_tracer else "float32",
                items=frozenset(),
                shadow_epsilon=0.0,
                answers=None,
                error=reply.error,
            )
        self._note(self._subject.renderer(name), reply)

    def _referred(self, name: str, reply: Reply) -> None:
        if reply.error is None:
            self._witnesses[name], versions = reply.value
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
        self._note(name, reply)

    def _note(self, renderer: str, reply: Reply) -> None:
        self._seconds[renderer] = reply.seconds
        if len(self._seconds) == len(self.planned.configurations) + len(self._references):
            task = JudgeTask(
                case=self.planned.case,
                candidates=tuple(self._candidates[name] for name in self.planned.configurations),
                witnesses=tuple(self._witnesses[name] for name in self._references),
                versions=self.versions,
                folder=self._folder,
                require=self._require,
                subject=self._subject,
                notes=self._notes,
                full=self._full,
                cached=self._cached,
            )
            # Judged before anything else is rendered: finished cases leave memory.
            self._pool.submit("judge", task, self._judged, first=True)

    def _judged(self, reply: Reply) -> None:
        record = reply.value if reply.error is None else self._unjudged(reply)
        for render in record["renders"]:
            render["seconds"] = round(self._seconds.get(render["renderer"], 0.0), 4)
        record["judge_seconds"] = round(reply.seconds, 4)
        record["seconds"] = round(sum(self._seconds.values()) + reply.seconds, 4)
        record["versions"] = self.versions
        self._finished(self, record)

    def _unjudged(self, reply: Reply) -> dict[str, Any]:
        """Return the record of a case whose judge died or raised: every planned check is an error."""
        case = self.planned.case
        why = f"judging failed: {reply.error}"
        checks = [
            {
                "configuration": configuration,
                "reference": name,
                "stage": stage.value,
                "verdict": Outcome.ERROR.value,
                "reason": why,
                "ratio": 0.0,
                "end_to_end": None,
                "continued": None,
                "because": "",
            }
            for configuration in self.planned.configurations
            for name, witness in self._witnesses.items()
            for stage in stages_of(case.scene)
            if witness.answers_at(stage)
        ]
        return {
            "name": case.name,
            "family": case.family,
            "verdict": Outcome.ERROR.value,
            "stage": None,
            "item": None,
            "reason": why,
            "trace": reply.trace,
            "stresses": case.stresses,
            "covers": list(case.covers),
            "planned": len(checks),
            "reproduce": reproduce(self._folder, case, self.planned.configurations, self._subject),
            "scene": write_scene(self._folder, case),
            "picture": None,
            "width": case.scene.camera.width,
            "height": case.scene.camera.height,
            "lights": len(case.scene.lights),
            "shapes": [type(shape).__name__ for shape in case.scene.shapes],
            "renders": [{"renderer": name, "image": None, "error": None} for name in self._seconds],
            "ran": {},
            "unsupported": [],
            "notes": [],
            "checks": checks,
            "expectations": [],
            "adjudication": {},
        }
