"""The packaged LLVM is the one that computes, unless the user names another."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import drjit as dr
import pytest

from rayproof.tracer.kernel import compiler
from rayproof.tracer.kernel.arrays import backend


def test_a_library_named_by_the_user_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(compiler.VARIABLE, "/a/library/of/mine.so")

    compiler.choose_packaged_llvm()

    assert os.environ[compiler.VARIABLE] == "/a/library/of/mine.so"


def test_no_packaged_library_leaves_the_choice_to_drjit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.delenv(compiler.VARIABLE, raising=False)

    compiler.choose_packaged_llvm()

    assert compiler.packaged_library() is None
    assert compiler.VARIABLE not in os.environ


def test_a_library_that_aborts_and_was_loaded_before_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    early = SimpleNamespace(detail=SimpleNamespace(llvm_version=lambda: (15, 0, 7)))
    monkeypatch.setitem(sys.modules, "drjit", early)
    monkeypatch.setattr(compiler, "packaged_library", lambda: Path("/the/packaged/library.so"))
    monkeypatch.delenv(compiler.VARIABLE, raising=False)

    with pytest.raises(compiler.NoBackendError, match=r"imported before rayproof and loaded LLVM 15\.0\.7") as told:
        compiler.choose_packaged_llvm()

    assert "\n" not in str(told.value)


@pytest.mark.process
@pytest.mark.parametrize(
    "order", ["import drjit; from rayproof import tracer", "from rayproof import tracer; import drjit"]
)
def test_neither_order_of_imports_kills_a_script(order: str) -> None:
    # What an older LLVM cannot compile: a constant of float64.
    script = f"{order}; import drjit.llvm; print(drjit.sqrt(drjit.llvm.Float64([2.0]) * 3.7))"
    environment = {name: value for name, value in os.environ.items() if name != compiler.VARIABLE}

    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)

    if done.returncode != 0:
        assert order.startswith("import drjit")
        assert "NoBackendError: Dr.Jit was imported before rayproof" in done.stderr.splitlines()[-1]


def test_the_loaded_llvm_can_compile_float64_and_minimum() -> None:
    if backend() != "llvm":
        pytest.skip("this machine computes on a GPU")

    assert dr.detail.llvm_version() >= (19,)
