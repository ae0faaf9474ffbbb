"""What workers of `rayproof laws` are told to do, and what they report."""

from dataclasses import dataclass

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.laws.judging import Judged
from rayproof.reports.subjects import Subject


@dataclass(frozen=True, kw_only=True)
class LawOrder:
    """Put one law to a subject on one case's scene."""

    law: str
    case: str
    scene: Scene
    subject: Subject
    configuration: str  # of the tracer; else the subject's name
    stages: tuple[Stage, ...]  # to be looked at
    keep: bool = False  # what it takes to look at it, too


@dataclass(frozen=True, kw_only=True, eq=False)
class Exhibit:
    """One change of a scene with everything that it takes to look at it; images by stage (height, width, channels)."""

    what: str  # the change, in words
    changed: Scene
    expected: StageImages  # what the law says of it
    measured: StageImages


@dataclass(frozen=True, kw_only=True)
class LawReport:
    """What became of an order: relations judged, or the sentence that says why there are none."""

    law: str
    case: str
    configuration: str
    judged: tuple[Judged, ...] = ()
    scenes: int = 0  # rendered for it
    unsupported: str | None = None  # the subject's reason
    error: str | None = None
    exhibit: Exhibit | None = None  # of the first change that breaks the law, else of the first

    @property
    def alarms(self) -> tuple[Judged, ...]:
        """Return the relations that are broken."""
        return tuple(one for one in self.judged if one.alarm)
