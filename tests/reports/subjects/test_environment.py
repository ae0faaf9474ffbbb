"""The environment variables that a program under test gets, and the note on those that it does not get."""

import json
import os
import sys
from pathlib import Path

import pytest

from rayproof.reports.subjects import environment
from rayproof.reports.subjects.calls import Ended, call
from rayproof.reports.subjects.choosing import chosen

REPORT = "import json, os; print(json.dumps(dict(os.environ)))"


def called(folder: Path, code: str, variables: tuple[str, ...] = ()) -> Ended:
    command = [sys.executable, "-I", "-S", "-c", code]
    return call(command, folder, seconds=60, memory=2**33, output=2**20, variables=variables)


@pytest.mark.process
def test_a_program_gets_what_it_needs_and_no_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GITHUB_TOKEN", "RAYPROOF_CACHE_KEY", "LC_TIME", "MY_LICENSE", "OMP_NUM_THREADS", "CUDA_HOME"):
        monkeypatch.setenv(name, "value")

    got = json.loads(called(tmp_path, REPORT).said)
    more = json.loads(called(tmp_path, REPORT, variables=("MY_LICENSE",)).said)

    assert {"PATH", "LC_TIME", "OMP_NUM_THREADS", "CUDA_HOME"} <= set(got)
    assert not {"GITHUB_TOKEN", "RAYPROOF_CACHE_KEY", "MY_LICENSE"} & set(got)
    assert set(more) - set(got) == {"MY_LICENSE"}


@pytest.mark.process
def test_a_program_that_fails_is_told_what_was_withheld(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_LICENSE", "value")

    ended = called(tmp_path, "import os; os.environ['MY_LICENSE']")

    count = len(os.environ) - len(environment())
    assert count >= 1
    assert f"exit code 1: KeyError: 'MY_LICENSE' ({count} environment variable" in (ended.problem or "")
    assert "withheld; --env NAME passes one on)" in (ended.problem or "")


def test_a_variable_that_is_not_there_is_no_name() -> None:
    with pytest.raises(ValueError, match="--env NOT_SET: there is no environment variable"):
        chosen(
            f"exec:{sys.executable} {{output}}",
            seconds=1,
            memory=2**30,
            ask=lambda _: pytest.fail("asked"),
            variables=("NOT_SET",),
        )
    with pytest.raises(ValueError, match="--env is for a program under test"):
        chosen(
            "mitsuba_scalar",
            seconds=1,
            memory=2**30,
            ask=lambda _: pytest.fail("asked"),
            variables=("PATH",),
        )
