"""What only some rays need is computed for them, and looks to the others as if it had never been asked."""

import drjit as dr
import numpy as np

from rayproof.reference.double_double.arithmetic import Pair, Questions, only_where, types


def test_values_and_margins_come_from_the_rays_that_need_them() -> None:
    float64, int32 = types().Float64, types().Int32
    numbers = dr.arange(float64, 64)
    ask = Questions(float64)

    def work(inner: Questions) -> list[object]:
        value = Pair(numbers, numbers / 2**60)
        return [value, inner.is_positive(value, float64(64)), int32(7)]

    value, positive, literal = only_where(numbers >= 40, ask, work)

    expected = np.where(np.arange(64) >= 40, np.arange(64), 0)
    assert np.array_equal(value.high, expected)
    assert np.array_equal(value.low, expected / 2**60)
    assert np.array_equal(positive, expected > 0)
    assert np.array_equal(literal, 7 * (expected > 0))
    assert np.array_equal(ask.least, np.where(expected > 0, expected / 64, np.inf))
