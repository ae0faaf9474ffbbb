"""The guards hold, and would be seen if they did not."""

import drjit as dr

from rayproof.reports.studies.stability.device import broken
from rayproof.tracer.kernel.arrays import array_types


def test_neither_fast_math_nor_contraction(precision: str) -> None:
    assert broken(precision) == []


def test_fast_math_is_seen(precision: str) -> None:
    array_types(precision)

    with dr.scoped_set_flag(dr.JitFlag.FastMath, True):
        found = broken(precision)

    assert any("FastMath is on" in one for one in found)
    assert any("NaN" in one for one in found)
