"""Dr.Jit's arithmetic is what the formulas count on: no FastMath, no contraction, NaN and signs kept, known ulps."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.kernel.arithmetic import difference_of_products, moved_by_ulps, next_towards
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types

CHECKOUT = Path(__file__).resolve().parents[2]
NUMPY = {"float32": np.float32, "float64": np.float64}


@pytest.fixture
def types(precision: str) -> ArrayTypes:
    """Return the array types of each precision."""
    return array_types(precision)


def opaque(types: ArrayTypes, *values: float) -> Any:
    """Return values that no constant folding can see."""
    array = types.Float(*values)
    dr.make_opaque(array)
    return array


def random(types: ArrayTypes, count: int, *, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(1, 2, count).astype(NUMPY[types.precision])


def test_fast_math_is_off(types: ArrayTypes) -> None:
    bad = opaque(types, dr.inf, -dr.inf, dr.nan)

    # FastMath would make literal zeros of these.
    assert not dr.flag(dr.JitFlag.FastMath)
    assert np.isnan(np.array(bad * 0)).all()
    assert np.isnan(np.array(dr.fma(bad, 0, 1))).all()


def test_products_and_sums_are_not_contracted(types: ArrayTypes) -> None:
    x, y = (types.Float(random(types, 100_000, seed=seed)) for seed in (1, 2))
    product = x * y
    dr.make_opaque(product)

    # A fused operation would return what rounding the product lost.
    assert not np.array(x * y - product).any()
    assert np.array(dr.fma(x, y, -product)).any()


def test_a_difference_of_products_keeps_its_digits(types: ArrayTypes) -> None:
    rng = np.random.default_rng(3)
    kind = NUMPY[types.precision]
    a, b, c = (rng.uniform(1, 2, 20_000).astype(kind) for _ in range(3))
    d = (a.astype(np.longdouble) * b / c).astype(kind)  # so that a b and c d cancel

    found = np.array(difference_of_products(*(types.Float(x) for x in (a, b, c, d))), dtype=np.longdouble)

    if types.precision == "float32":
        # Products of float32 numbers are exact in long double.
        exact = a.astype(np.longdouble) * b - c.astype(np.longdouble) * d
        assert np.abs(found - exact).max() <= 3 * UNIT_ROUNDOFF["float32"] * np.abs(exact).max()
        assert (np.abs(found - exact) <= 3 * UNIT_ROUNDOFF["float32"] * np.abs(exact)).all()
    reverse = np.array(difference_of_products(*(types.Float(x) for x in (c, d, a, b))), dtype=np.longdouble)
    np.testing.assert_array_equal(np.sign(found), -np.sign(reverse))


@pytest.mark.parametrize(
    ("name", "limit"),
    [("rcp", 0.51), ("sqrt", 0.51), ("rsqrt", 2.0), ("tan", 3.0)],
)
def test_functions_are_as_accurate_as_the_limits_assume(name: str, limit: float) -> None:
    types = array_types("float32")
    if types.backend != "llvm":
        pytest.skip("the limits were measured on LLVM")
    exact: dict[str, Callable[[Any], Any]] = {
        "rcp": lambda x: 1 / x,
        "sqrt": np.sqrt,
        "rsqrt": lambda x: 1 / np.sqrt(x),
        "tan": lambda x: np.tan(x - 1),  # half of a vertical angle, in [0, 1]
    }
    x = random(types, 100_000, seed=4)
    given = types.Float(x) - 1 if name == "tan" else types.Float(x)

    found = np.array(getattr(dr, name)(given)).astype(np.float64)

    truth = exact[name](x.astype(np.float64))
    ulp = np.spacing(np.abs(truth).astype(np.float32)).astype(np.float64)
    assert (np.abs(found - truth) / ulp).max() <= limit


def test_minimum_and_maximum_keep_a_nan_and_fmin_and_fmax_drop_it(types: ArrayTypes) -> None:
    nan, one = opaque(types, dr.nan), opaque(types, 1.0)

    assert np.isnan(np.array([dr.maximum(nan, one)[0], dr.minimum(one, nan)[0], dr.clip(nan, 0, 1)[0]])).all()
    dropping: Any = [dr.fmax(nan, one), dr.fmin(one, nan)]
    assert [x[0] for x in dropping] == [1, 1]


def test_zeros_keep_their_sign(types: ArrayTypes) -> None:
    zeros = opaque(types, 0.0, -0.0)

    assert list(1 / zeros) == [dr.inf, -dr.inf]
    # Stable roots use copysign: a sign of 0 that is 0 would lose the far root.
    assert list(dr.copysign(types.Float(2), zeros)) == [2, -2]


@pytest.mark.process
def test_subnormals_are_kept_on_the_cpu(types: ArrayTypes) -> None:
    if types.backend != "llvm":
        pytest.skip("a GPU flushes float32 subnormals")
    # In a process of its own, as the harness renders: another renderer's library may have told this one's processor
    # to flush them (Embree, which Mitsuba uses, does).
    script = (
        "import drjit as dr, numpy as np, sys; from rayproof.tracer.kernel.arrays import array_types; "
        "types = array_types(sys.argv[1]); smallest = float(np.finfo(sys.argv[1]).smallest_subnormal); "
        "x = types.Float(smallest * 4); dr.make_opaque(x); sys.exit(int((x / 2)[0] != smallest * 2))"
    )

    ended = subprocess.run([sys.executable, "-c", script, types.precision], cwd=CHECKOUT, check=False)

    assert ended.returncode == 0


def test_neighbours_of_a_float_are_its_neighbours(types: ArrayTypes) -> None:
    kind = NUMPY[types.precision]
    values = [1.0, -1.0, 0.0, 1.5e-30, -3.25]
    x = opaque(types, *values)

    for sign, towards in ((1.0, np.inf), (-1.0, -np.inf)):
        expected = np.nextafter(np.array(values, dtype=kind), kind(towards))
        np.testing.assert_array_equal(np.array(next_towards(x, types.Float(sign))), expected)
    np.testing.assert_array_equal(np.array(next_towards(x, types.Float(0))), np.array(values, dtype=kind))
    three = np.array(moved_by_ulps(x, types.Float(3.0)))[:2]
    np.testing.assert_array_equal(three, [1 + 3 * np.spacing(kind(1)), -1 + 3 * np.spacing(kind(0.5))])
