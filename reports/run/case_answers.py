"""`Render`, the reply of a renderer's worker; and `CaseAnswers`, all answers to a case, which the judge gets."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rayproof.reports.judge.answers import Answers

if TYPE_CHECKING:
    from rayproof.reports.subjects.serving import Standing


@dataclass(frozen=True, kw_only=True)
class Render:
    """The answers of a renderer to a case, and what else its worker reports of it."""

    answers: Answers
    versions: dict[str, str]  # of the programs that computed it, by name; none where it failed
    notes: tuple[str, ...] = ()  # of a subject, on its answers
    launches: tuple[float, int] | None = None  # of the tracer: median time [s] of a launch, and how many there were
    standing: "Standing | None" = None  # of a program that stays alive


@dataclass(frozen=True, kw_only=True)
class CaseAnswers:
    """All answers to a case, which the judge gets: the subject's by each configuration, and the references'."""

    subjects: tuple[Answers, ...]
    again: tuple[Answers, ...] = ()  # the subject's second answers, where one of them differs
    references: tuple[Answers, ...] = ()
    versions: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # of the subject, on its answers
