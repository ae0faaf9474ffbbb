"""What workers are told to do, as plain data that travels between processes."""

from dataclasses import dataclass
from pathlib import Path

from cases.case import Case
from cases.scene import Scene
from reports.judge.parties import Candidate, Witness


@dataclass(frozen=True, kw_only=True)
class TracerTask:
    """Render a scene by one configuration; the answer is a Candidate."""

    scene: Scene
    configuration: str
    samples: int


@dataclass(frozen=True, kw_only=True)
class ReferenceTask:
    """Render a scene by the worker's reference; the answer is a Witness with its version."""

    scene: Scene
    samples: int


@dataclass(frozen=True, kw_only=True)
class JudgeTask:
    """Judge a case and write its images and scene below `folder`; the answer is the case's record."""

    case: Case
    candidates: tuple[Candidate, ...]
    witnesses: tuple[Witness, ...]
    versions: dict[str, str]
    folder: Path
    require: tuple[str, ...]
