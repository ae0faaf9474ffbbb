"""Which stages a reference copied from the renderer under test: numbers that nobody computes alike by chance."""

import numpy as np

from rayproof.cases.stages import Stage, StageImages

# A reference must have computed its own answer: one that repeats the subject's to the last bit is a copy.
#
# Two who compute the same quantity by themselves agree on a number wherever both round it rightly. So a number tells
# of a copy only if rounding it is no matter of course. Numbers of few digits come out of few operations, which round
# nothing: half of the digits, binary or decimal, must not hold it. A float32 that two float32 renderers share tells
# only if it is not the float32 nearest to the truth, so that both made the same mistake, by chance at most every
# other time.


# At odds of one half each, so many different numbers agree by chance once in 2^64 images.
LEAST_DISTINCT = 64
# Half of the binary and of the decimal digits of float32 and of float64.
HALF_OF_SINGLE, HALF_OF_DOUBLE = (12, 4), (26, 8)
# Not object and visibility, which are whole numbers, nor normals, of which a scene may have few and simple ones.
ROUNDED = (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def copied(ours: StageImages, theirs: StageImages, truth: StageImages, *, both_float32: bool) -> tuple[Stage, ...]:
    """Return the stages that are the same to the last bit in every pixel, and full of numbers that rounding tells."""

    def same(stage: Stage) -> bool:
        mine, right = ours[stage], truth.get(stage)
        if not np.array_equal(mine, theirs[stage]):
            return False
        values, places = np.unique(np.asarray(mine, dtype=np.float64), return_index=True)
        if stage is Stage.POSITION and Stage.DISTANCE in truth:
            # eye + t d is the eye's own digits where that is larger than t, and then rounds alike for all.
            t = np.broadcast_to(truth[Stage.DISTANCE], np.shape(mine)).ravel()[places]
            values, places = values[np.abs(values) < t], places[np.abs(values) < t]
        known = right is not None and np.shape(right) == np.shape(mine)
        telling = _telling(values)
        if both_float32 and known:
            with np.errstate(over="ignore", invalid="ignore"):
                telling &= values != np.asarray(right).ravel()[places].astype(np.float32)
        return int(np.count_nonzero(telling)) >= LEAST_DISTINCT

    return tuple(stage for stage in ROUNDED if stage in ours and stage in theirs and same(stage))


def _telling(values: np.ndarray) -> np.ndarray:
    """Return which numbers (n,) half of their format's digits do not hold."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = values.astype(np.float32) == values
    full = np.isfinite(values) & (values != 0)
    fractions = np.frexp(values)[0]
    for mine, (bits, decimals) in ((single, HALF_OF_SINGLE), (~single, HALF_OF_DOUBLE)):
        significand = np.ldexp(fractions, bits)
        full &= ~mine | (significand != np.rint(significand))
        for place in np.flatnonzero(full & mine):
            rounded = float(f"{values[place]:.{decimals}g}")
            full[place] = (np.float32(rounded) if single[place] else rounded) != values[place]
    return full
