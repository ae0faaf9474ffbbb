"""A witness must have computed its own answer: one that repeats the candidate's to the last bit is a copy."""

import numpy as np

from cases.answers import Answers
from cases.stages import Stage

# Independent roundings agree on a number by chance now and then; on this many different ones at once they do not.
LEAST_DISTINCT = 64


def copied(ours: Answers, theirs: Answers) -> bool:
    """Say whether every ray, position and radiance that both give is the same to the last bit."""
    shared = [stage for stage in (Stage.RAY, Stage.POSITION, Stage.RADIANCE) if stage in ours and stage in theirs]
    values = []
    for stage in shared:
        mine, other = np.asarray(ours[stage]), np.asarray(theirs[stage])
        if mine.shape != other.shape or not np.array_equal(mine, other):
            return False
        values.append(mine.ravel())
    return bool(values) and len(np.unique(np.concatenate(values))) >= LEAST_DISTINCT
