"""The tasks that travel to workers (`TracerTask`, `JudgeTask`, ...) and the names of kinds of workers."""

from dataclasses import dataclass
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.reports.judge.answers import Answers
from rayproof.reports.run.options import EVERY_CASE, KeptImages
from rayproof.reports.subjects import THE_TRACER, Subject


@dataclass(frozen=True, kw_only=True)
class TracerTask:
    """Render a scene by one configuration; the answer is what `reports.run.tracer_task.trace` returns."""

    scene: Scene
    configuration: str
    samples: int
    launches: int = 1  # the median of which is its time; the images are the first one's
    copies: tuple[tuple[str, str], ...] = ()  # of the user's files: the path that he wrote, and where it lies here
    own: tuple[str, ...] = ()  # the user's own formulas as the run knows them (`Demands.own`); any other is refused


@dataclass(frozen=True, kw_only=True)
class ReferenceTask:
    """Render a scene by the worker's reference; the answer is a Answers with its version."""

    scene: Scene
    samples: int
    cached: bool = False  # what was rendered before may be taken from the cache


@dataclass(frozen=True, kw_only=True)
class RecallTask:
    """Ask the cache what references answered before.

    The answer is name -> (Answers, its version) of those found, and name -> a sentence of each entry that was damaged.
    """

    names: tuple[str, ...]
    task: ReferenceTask


@dataclass(frozen=True, kw_only=True)
class SubjectTask:
    """Render a scene by the subject; the answer is a Answers with its version and notes."""

    scene: Scene
    samples: int
    subject: Subject
    keep: Path | None = None  # the folder in which a program's call is kept


@dataclass(frozen=True, kw_only=True)
class QuestionTask:
    """Put `--capabilities` to a program; the answer is its Capabilities, or the sentence that says what is wrong."""

    subject: Subject
    seconds: float


@dataclass(frozen=True, kw_only=True)
class GuardTask:
    """Judge the sentinels; who judges a case does so first, if nobody did."""

    cached: bool  # that they were judged well may be kept, and taken from the cache


@dataclass(frozen=True, kw_only=True)
class RepeatTask:
    """Hold a second answer to a case against the first; the answer is a `RepeatedRecord`."""

    case: Case
    first: Answers
    again: Answers
    varies: bool  # the subject's images of one scene may differ within the limits


@dataclass(frozen=True, kw_only=True)
class JudgeTask:
    """Judge a case and write its images and scene below `folder`; the answer is the case's record."""

    case: Case
    subjects: tuple[Answers, ...]
    references: tuple[Answers, ...]
    versions: dict[str, str]
    folder: Path
    require: tuple[str, ...]
    panel: tuple[
        str, ...
    ] = ()  # the references that the run announced: of one that is not among `references` we say so
    subject: Subject = THE_TRACER
    notes: tuple[str, ...] = ()  # what the subject says of its answers
    images: KeptImages = EVERY_CASE  # of which cases they are kept
    cached: bool = False  # a passed self-test of the judge may be taken from the cache
    again: tuple[Answers, ...] = ()  # the subjects' second answers, where one of them differs


TRACING = "tracer"
JUDGE = "judge"
RECALLING = "cache"
UNDER_TEST = "subject:"  # and the name of a reference that is under test


def kind_of(subject: Subject) -> str:
    """Return the kind of the workers that ask a subject."""
    if subject.is_tracer:
        return TRACING
    return subject.transport or f"{UNDER_TEST}{subject.name}"
