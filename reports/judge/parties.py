"""The parties to a case: the renderers under test and the references, with what they answered."""

from dataclasses import dataclass, field

import numpy as np

from cases.answers import Answers
from cases.stages import Stage


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A renderer under test: one tracer configuration and its answers, or the error that it ended in."""

    name: str
    precision: str
    items: frozenset[str]  # specification items whose formulas it ran
    # m, one for all or per pixel: how far it admits to move or ignore things at a feeler's start
    shadow_epsilon: float | np.ndarray
    answers: Answers | None
    error: str | None = None
    fine: Answers | None = None  # at the resolution of a case's samples: the tracer's own answers there

    @property
    def by_matrices(self) -> bool:
        """Say whether its rays come by the inverse matrices (CAM-5)."""
        return "CAM-5" in self.items


@dataclass(frozen=True, kw_only=True)
class Witness:
    """A reference and its answers, with what it declared that it cannot do."""

    name: str
    precision: str
    independent: bool  # shares neither code nor Dr.Jit's compiler with the tracer
    shadow_epsilon: float  # m
    answers: Answers
    unsupported: dict[Stage, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # where it answers another question than the one asked, in sentences
    mean: np.ndarray | None = None  # (height, width, 3): radiance box-filtered over a case's samples
    error: str | None = None

    def answers_at(self, stage: Stage) -> bool:
        """Say whether it is asked about this stage: everything that it did not declare unsupported."""
        return stage not in self.unsupported
