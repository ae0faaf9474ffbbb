"""Answers that are the same to the last bit as one object, so that what was measured of one is known of all.

Configurations that differ in one formula share every stage before it.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.answers import Answers
from rayproof.cases.stages import Stage
from rayproof.reports.judge.renderers import Candidate


def shared(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates, equal answers of theirs being one object."""
    known: dict[Stage, list[Any]] = {}
    return [
        candidate if candidate.answers is None else replace(candidate, answers=_shared(candidate.answers, known))
        for candidate in candidates
    ]


def _shared(answers: Answers, known: dict[Stage, list[Any]]) -> Answers:
    found: Answers = {}
    for stage, image in answers.items():
        seen = known.setdefault(stage, [])
        found[stage] = next((one for one in seen if _same(stage, one, image)), image)
        if found[stage] is image:
            seen.append(image)
    return found


def _same(stage: Stage, one: Any, other: Any) -> bool:
    """Say whether two answers are equal to the last bit; a NaN equals nothing, which costs time and nothing else."""
    if stage is not Stage.CAMERA:
        return np.shape(one) == np.shape(other) and np.array_equal(one, other)
    return one.keys() == other.keys() and all(np.array_equal(one[part], other[part]) for part in one)
