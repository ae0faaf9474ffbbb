"""The guards hold, and would be seen if they did not."""

import drjit as dr
import numpy as np

from rayproof.reports.studies.stability.device import broken, number
from rayproof.tracer.kernel.arrays import array_types


def test_neither_fast_math_nor_contraction(precision: str) -> None:
    assert broken(precision) == []


def test_fast_math_is_seen(precision: str) -> None:
    array_types(precision)

    with dr.scoped_set_flag(dr.JitFlag.FastMath, True):
        found = broken(precision)

    assert any("FastMath is on" in one for one in found)
    assert any("NaN" in one for one in found)


def test_a_fused_product_would_be_seen(precision: str) -> None:
    generator = np.random.default_rng(7)
    x, y = generator.uniform(1, 2, (2, 1000))
    types = array_types(precision)
    product = number(x, types) * number(y, types)
    dr.eval(product)

    rest = np.array(dr.fma(number(x, types), number(y, types), -product))

    # What the guard looks for is there as soon as a product and a sum are fused.
    assert np.any(rest != 0)
