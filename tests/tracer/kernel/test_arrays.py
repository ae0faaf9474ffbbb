"""Array types and the flags that change their arithmetic."""

import drjit as dr

from rayproof.tracer.kernel.arrays import array_types, versions


def test_fast_math_is_off_so_that_nan_times_zero_is_nan(precision: str) -> None:
    Float = array_types(precision).Float

    product = Float(dr.nan, 1.0) * Float(0)

    assert dr.isnan(product[0])
    assert product[1] == 0
    assert versions()["drjit_FastMath"] == "off"
