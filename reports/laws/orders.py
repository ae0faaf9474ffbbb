"""What workers of `rayproof laws` are told to do, and what they report."""

from dataclasses import dataclass

from cases.scene import Scene
from cases.stages import Stage
from reports.laws.judging import Judged
from reports.subjects import Subject


@dataclass(frozen=True, kw_only=True)
class LawOrder:
    """Put one law to a subject on one case's scene."""

    law: str
    case: str
    scene: Scene
    subject: Subject
    configuration: str  # of the tracer; else the subject's name
    stages: tuple[Stage, ...]  # to be looked at
    keep: bool = False  # the first broken relation's scenes and images, too


@dataclass(frozen=True, kw_only=True)
class Exhibit:
    """A broken relation with everything that it takes to look at it: images (height, width, channels)."""

    stage: Stage
    scene: Scene
    changed: Scene
    expected: bytes  # of an image, float64
    measured: bytes
    shape: tuple[int, ...]
    over: bytes  # error over limit (height, width), float64


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
    exhibit: Exhibit | None = None

    @property
    def alarms(self) -> tuple[Judged, ...]:
        """Return the relations that are broken."""
        return tuple(one for one in self.judged if one.alarm)
