"""Ctrl-C, or being told to terminate, ends a run with 130 and leaves nothing running that it had started."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from reports.run.pool import Pool
from reports.subjects.orphans import descendants

CHECKOUT = Path(__file__).parents[3]
NAP = "86398.375"  # s; no other process sleeps as long


def sleepers() -> list[psutil.Process]:
    return [one for one in psutil.process_iter(["cmdline"]) if NAP in (one.info["cmdline"] or ())[1:2]]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM"])
def test_nothing_is_left_running(tmp_path: Path, how: str) -> None:
    script = tmp_path / "render"
    # A child in a session of its own as well: it does not get the terminal's signal.
    script.write_text(f'#!/bin/sh\n[ "$1" = --capabilities ] && exit 1\nsetsid sleep {NAP} &\nexec sleep {NAP}\n')
    script.chmod(0o755)
    command = ["run", "primitives/sphere", "--jobs", "1", "--out", str(tmp_path / "out")]
    # A shell without job control starts background jobs with Ctrl-C ignored, and CI may be one.
    heeding = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heeding}; import sys; from reports.cli import main; sys.exit(main(sys.argv[1:]))"
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

    assert process.returncode == 130, printed
    assert "interrupted after 0 of 1 cases" in printed
    assert sleepers() == []


def test_a_worker_that_is_lost_takes_with_it_what_it_started() -> None:
    pool = Pool(jobs=1, timeout=3.0, target=_starts_a_sleeper)
    replies = []
    pool.submit("any", "task", replies.append)

    while not replies:
        pool.step()

    assert "no answer within 3 s" in replies[0].error
    assert [one for one in descendants(os.getpid()) if one.name() == "sleep"] == []
    pool.close()


def _starts_a_sleeper(kind: str, connection: object) -> None:
    subprocess.run(["sleep", "77.25"], check=False)
