"""A witness must have computed its own answer: one that repeats the candidate's to the last bit is a copy."""

import numpy as np

from cases.answers import Answers
from cases.stages import Stage

# Independent roundings agree on a number by chance now and then; on this many different ones at once they do not.
LEAST_DISTINCT = 64
# Not object and visibility, which are whole numbers, nor normals, of which a scene may have few and simple ones.
ROUNDED = (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def copied(ours: Answers, theirs: Answers) -> tuple[Stage, ...]:
    """Return the stages that are the same to the last bit in every pixel, and full of numbers that rounding tells."""
    return tuple(stage for stage in ROUNDED if stage in ours and stage in theirs and _same(ours[stage], theirs[stage]))


def _same(mine: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(mine, other) and len(np.unique(mine)) >= LEAST_DISTINCT
