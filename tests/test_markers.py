"""A test that takes more than its own process without the marker for it fails, whoever catches the complaint."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
TESTS = """
import contextlib, multiprocessing, os, subprocess, sys
import pytest

@pytest.fixture(scope="module")
def of_a_fixture(): subprocess.run([sys.executable, "-c", ""])

def test_process_of_a_fixture(of_a_fixture): pass
def test_process_caught():
    with contextlib.suppress(BaseException): subprocess.run([sys.executable, "-c", ""])
def test_process_by_fork():
    if os.fork() == 0: os._exit(0)
def test_process_by_multiprocessing(): multiprocessing.get_context("spawn").Process(target=print).start()
def test_references(): import mitsuba
@pytest.mark.process
def test_references_too(): import mitsuba
@pytest.mark.process
def test_marked(): subprocess.run([sys.executable, "-c", ""])
"""


@pytest.mark.process
def test_what_a_test_takes_beyond_its_process_must_be_marked(tmp_path: Path) -> None:
    (tmp_path / "test_these.py").write_text(TESTS)
    (tmp_path / "conftest.py").write_text((CHECKOUT / "tests" / "conftest.py").read_text())
    pytest_here = [sys.executable, "-m", "pytest", "-c", str(CHECKOUT / "pyproject.toml"), "--rootdir", str(tmp_path)]

    said = subprocess.run(
        [*pytest_here, "-rA", str(tmp_path)], capture_output=True, text=True, env=os.environ | {"COLUMNS": "400"}
    ).stdout

    told = {line.split("::test_")[1].split()[0]: line for line in said.splitlines() if "::test_" in line}
    assert told.pop("marked").startswith("PASSED")
    assert sorted(told) == [
        "process_by_fork",
        "process_by_multiprocessing",
        "process_caught",
        "process_of_a_fixture",
        "references",
        "references_too",
    ]
    for name, line in told.items():
        assert line.startswith(("FAILED", "ERROR"))
        assert f"must be marked `{name.split('_')[0]}`" in line
