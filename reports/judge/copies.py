"""Stages that a reference copied from the subject, recognised by numbers that do not agree by chance."""

import numpy as np

from rayproof.cases.stages import Stage, StageImages

# A reference must compute its own answer: one that repeats the subject's to the last bit is a copy.
#
# Two renderers that compute the same quantity independently agree on a number if both round it correctly. So a number
# is evidence of a copy only if its rounding is not obvious. Numbers with few digits result from few operations without
# rounding: a number counts only if half of the digits, binary or decimal, cannot represent it. A float32 number that
# two float32 renderers share counts only if it is not the float32 number nearest to the truth, so that both have the
# same error, which happens by chance at most half of the time.


# At odds of one half each, so many different numbers agree by chance once in 2^64 images.
LEAST_DISTINCT = 64
# Half of the binary and of the decimal digits of float32 and of float64.
HALF_OF_SINGLE, HALF_OF_DOUBLE = (12, 4), (26, 8)
# Not object and visibility, which are integers, nor normals, which may be few and simple in a scene.
ROUNDED = (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def copied(images: StageImages, originals: StageImages, truth: StageImages, *, both_float32: bool) -> tuple[Stage, ...]:
    """Return the stages that are bit-identical in every pixel and have enough numbers that are evidence of a copy."""

    def same(stage: Stage) -> bool:
        image, right = images[stage], truth.get(stage)
        if not np.array_equal(image, originals[stage]):
            return False
        values, places = np.unique(np.asarray(image, dtype=np.float64), return_index=True)
        if stage is Stage.POSITION and Stage.DISTANCE in truth:
            # If the eye's coordinate is larger than t, eye + t d has the eye's digits, and all renderers round alike.
            t = np.broadcast_to(truth[Stage.DISTANCE], np.shape(image)).ravel()[places]
            values, places = values[np.abs(values) < t], places[np.abs(values) < t]
        comparable = right is not None and np.shape(right) == np.shape(image)
        telling = _telling(values)
        if both_float32 and comparable:
            with np.errstate(over="ignore", invalid="ignore"):
                telling &= values != np.asarray(right).ravel()[places].astype(np.float32)
        return int(np.count_nonzero(telling)) >= LEAST_DISTINCT

    return tuple(stage for stage in ROUNDED if stage in images and stage in originals and same(stage))


def _telling(values: np.ndarray) -> np.ndarray:
    """Return a mask of numbers (n,) that half of their format's digits cannot represent."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = values.astype(np.float32) == values
    full = np.isfinite(values) & (values != 0)
    fractions = np.frexp(values)[0]
    for members, (bits, decimals) in ((single, HALF_OF_SINGLE), (~single, HALF_OF_DOUBLE)):
        significand = np.ldexp(fractions, bits)
        full &= ~members | (significand != np.rint(significand))
        for place in np.flatnonzero(full & members):
            rounded = float(f"{values[place]:.{decimals}g}")
            full[place] = (np.float32(rounded) if single[place] else rounded) != values[place]
    return full
