"""The packaged LLVM is the one that computes, unless the user names another."""

import os
import sys
from pathlib import Path

import drjit as dr
import pytest

from tracer import llvm
from tracer.arrays import backend


def test_a_library_named_by_the_user_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(llvm.VARIABLE, "/a/library/of/mine.so")

    llvm.select()

    assert os.environ[llvm.VARIABLE] == "/a/library/of/mine.so"


def test_no_packaged_library_leaves_the_choice_to_drjit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.delenv(llvm.VARIABLE, raising=False)

    llvm.select()

    assert llvm.packaged_library() is None
    assert llvm.VARIABLE not in os.environ


def test_the_loaded_llvm_can_compile_float64_and_minimum() -> None:
    if backend() != "llvm":
        pytest.skip("this machine computes on a GPU")

    assert dr.detail.llvm_version() >= (19,)
