"""Answers that are the same to the last bit as one object, so that what was measured of one is known of all.

Configurations that differ in one formula share every stage before it.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.renderers import Candidate


def with_equal_answers_shared(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates, equal answers of theirs being one object that goes by the name of the first of them."""
    known: dict[Stage, list[tuple[str, Any]]] = {}
    return [_shared(candidate, known) for candidate in candidates]


def _shared(candidate: Candidate, known: dict[Stage, list[tuple[str, Any]]]) -> Candidate:
    if candidate.answers is None:
        return candidate
    answers: StageImages = {}
    authors = {}
    for stage, image in candidate.answers.items():
        seen = known.setdefault(stage, [])
        name, first = next((one for one in seen if _same(stage, one[1], image)), (candidate.name, image))
        answers[stage] = first
        if name == candidate.name:
            seen.append((name, image))
        else:
            authors[stage] = name
    return replace(candidate, answers=answers, authors=authors)


def _same(stage: Stage, one: Any, other: Any) -> bool:
    """Say whether two answers are equal to the last bit; a NaN equals nothing, which costs time and nothing else."""
    if stage is not Stage.CAMERA:
        return np.shape(one) == np.shape(other) and np.array_equal(one, other)
    return one.keys() == other.keys() and all(np.array_equal(one[part], other[part]) for part in one)
