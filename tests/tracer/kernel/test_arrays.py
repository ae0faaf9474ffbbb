"""Array types and the flags that change their arithmetic."""

import drjit as dr
import pytest

from rayproof.tracer.kernel.arrays import array_types, backend, versions


def test_fast_math_is_off_so_that_nan_times_zero_is_nan(precision: str) -> None:
    Float = array_types(precision).Float

    product = Float(dr.nan, 1.0) * Float(0)

    assert dr.isnan(product[0])
    assert product[1] == 0
    assert versions()["drjit_FastMath"] == "off"


def test_an_unknown_precision_names_those_that_exist() -> None:
    with pytest.raises(LookupError, match=r"'half'.*float32, float64"):
        array_types("half")


def test_no_backend_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    backend.cache_clear()
    monkeypatch.setattr(dr, "has_backend", lambda _: False)

    with pytest.raises(RuntimeError, match="neither an NVIDIA GPU nor a usable LLVM"):
        backend()

    backend.cache_clear()
