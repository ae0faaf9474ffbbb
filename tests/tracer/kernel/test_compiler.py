"""The packaged LLVM is the one that computes, unless the user names another."""

import sys
from pathlib import Path
from types import SimpleNamespace

import drjit as dr
import pytest

from rayproof.tracer.kernel import compiler
from rayproof.tracer.kernel.arrays import backend


def test_a_library_that_aborts_and_was_loaded_before_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    early = SimpleNamespace(detail=SimpleNamespace(llvm_version=lambda: (15, 0, 7)))
    monkeypatch.setitem(sys.modules, "drjit", early)
    monkeypatch.setattr(compiler, "packaged_library", lambda: Path("/the/packaged/library.so"))
    monkeypatch.delenv(compiler.VARIABLE, raising=False)

    with pytest.raises(compiler.NoBackendError, match=r"imported before rayproof and loaded LLVM 15\.0\.7") as told:
        compiler.choose_packaged_llvm()

    assert "\n" not in str(told.value)


def test_the_loaded_llvm_can_compile_float64_and_minimum() -> None:
    if backend() != "llvm":
        pytest.skip("this machine computes on a GPU")

    assert dr.detail.llvm_version() >= (19,)
