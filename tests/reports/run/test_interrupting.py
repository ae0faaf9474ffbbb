"""Ctrl-C, or being told to terminate, ends a run with 130 and leaves nothing running that it had started."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

pytestmark = pytest.mark.process

CHECKOUT = Path(__file__).parents[3]
NAP = f"86398.{os.getpid()}"  # s; no other process sleeps as long, nor another run of this test


def sleepers() -> list[psutil.Process]:
    return [one for one in psutil.process_iter(["cmdline"]) if NAP in (one.info["cmdline"] or ())[1:2]]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "SIGKILL"])
def test_nothing_is_left_running(tmp_path: Path, how: str) -> None:
    script = tmp_path / "render"
    # A child in a session of its own as well: it does not get the terminal's signal.
    script.write_text(f'#!/bin/sh\n[ "$1" = --capabilities ] && exit 1\nsetsid sleep {NAP} &\nexec sleep {NAP}\n')
    script.chmod(0o755)
    command = ["run", "primitives/sphere", "--jobs", "1", "--out", str(tmp_path / "out")]
    # A shell without job control starts background jobs with Ctrl-C ignored, and CI may be one.
    heeding = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heeding}; import sys; from rayproof.reports.cli import main; sys.exit(main(sys.argv[1:]))"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *command, "--subject", f"exec:{script} {{scene}} {{output}}"],
        cwd=CHECKOUT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        deadline = time.monotonic() + 200
        while len(sleepers()) < 2 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.1)
        assert len(sleepers()) == 2, "the program and its child run"

        process.send_signal(getattr(signal, how))
        printed, _ = process.communicate(timeout=200)
    finally:
        process.kill()

    if how == "SIGKILL":  # nobody is left to end what runs, but the kernel and the program's keeper
        deadline = time.monotonic() + 10
        while sleepers() and time.monotonic() < deadline:
            time.sleep(0.1)
    else:
        assert process.returncode == 130, printed
        assert "interrupted after 0 of 1 cases" in printed
    assert sleepers() == []


def started_run(tmp_path: Path, *more: str, **environment: str) -> subprocess.Popen[str]:
    """Start a run of one case, its temporary files in a folder of their own."""
    (tmp_path / "tmp").mkdir(exist_ok=True)
    heeding = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heeding}; import sys; from rayproof.reports.cli import main; sys.exit(main(sys.argv[1:]))"
    return subprocess.Popen(
        [sys.executable, "-c", code, "run", "primitives/sphere", "--out", str(tmp_path / "out"), *more],
        cwd=CHECKOUT,
        env={**os.environ, "TMPDIR": str(tmp_path / "tmp"), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_a_full_disk_is_one_line_and_resuming_is_exact(tmp_path: Path) -> None:
    limited = f"{CHECKOUT / 'python'}{os.pathsep}{tmp_path}"
    # No file above 4 KB: as a disk that is full, but for everything at once and without rights of mounting.
    (tmp_path / "sitecustomize.py").write_text(
        "import resource, sys\n"
        "if sys.argv[:1] == ['-c'] and not any('processes.pool import begin' in word for word in sys.orig_argv):\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))\n"
    )
    full = started_run(tmp_path, "--no-cache", PYTHONPATH=limited, PYTHONDONTWRITEBYTECODE="1")
    out, error = full.communicate(timeout=200)

    assert full.returncode == 3, error
    assert error.count("\n") == 1
    # Before the results folder fills, what the guards of the harness write for themselves does.
    assert error.startswith(f"rayproof: {tmp_path}")
    assert "--resume goes on" in error
    again = started_run(tmp_path, "--no-cache", "--resume")
    out, error = again.communicate(timeout=200)
    assert (again.returncode, error) == (0, "")
    assert "1 planned, 1 pass" in out
