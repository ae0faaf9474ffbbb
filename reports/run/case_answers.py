"""`Render`, the reply of a renderer's worker; and `CaseAnswers`, all answers to a case, which the judge gets."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rayproof.reports.judge.answers import Answers

if TYPE_CHECKING:
    from rayproof.reports.subjects.serving import ServingCost


@dataclass(frozen=True, kw_only=True)
class Render:
    """A renderer's answers to a case, and the versions, notes and times that its worker reports."""

    answers: Answers
    versions: dict[str, str]  # of the programs that computed the answers, by name; empty after a failure
    notes: tuple[str, ...] = ()  # of a subject, on its answers
    launches: tuple[float, int] | None = None  # of the tracer: median time [s] and number of the launches
    standing: "ServingCost | None" = None  # of a program that stays alive


@dataclass(frozen=True, kw_only=True)
class CaseAnswers:
    """All answers to a case, which the judge gets: the subject's by each configuration, and the references'."""

    subjects: tuple[Answers, ...]
    again: tuple[Answers, ...] = ()  # the subject's second answers, if any of them differs from the first
    references: tuple[Answers, ...] = ()
    versions: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # of the subject, on its answers
