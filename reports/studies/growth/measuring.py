"""One suite of a given size as a user runs it, in a process of its own: its time, its memory, its folder."""

import json
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rayproof.reports.cache.store import VARIABLE
from rayproof.reports.studies.growth.scenes import write_scenes

COMMAND = "import sys; from {module} import main; sys.exit(main())"
MODULE = "rayproof.reports.cli"
RESULTS = "results"  # the run's own folder below its place
LINE = 200  # characters of a failed run's last line
AGAIN = ("at first", "again")  # with nothing kept, and with everything


class GrowthError(RuntimeError):
    """A run did not pass, so that its time says nothing."""


def measured(counts: Sequence[int]) -> Iterator[dict[str, Any]]:
    """Yield the cost of a run of each count of cases, at first and again.

    Raises:
        GrowthError: a run did not measure and pass every case.

    """
    for count in counts:
        with TemporaryDirectory(prefix="rayproof-") as folder:
            place = Path(folder)
            (place / "scenes").mkdir()
            files = write_scenes(count, place / "scenes")
            for when in AGAIN:
                yield {"cases": count, "when": when, **_cost(files, place)}


def _cost(files: Sequence[Path], place: Path) -> dict[str, Any]:
    """Return the cost of judging scene files, every one of which must pass."""
    cost = cost_of_run([file.name for file in files], place, folder=place / "scenes")
    passed = json.loads((place / RESULTS / "results.json").read_text(encoding="utf-8"))["summary"]["pass"]
    if passed != len(files):
        raise GrowthError(f"of {len(files)} cases {passed} passed")
    return cost


def cost_of_run(
    arguments: Sequence[str],
    place: Path,
    *,
    folder: Path,
    environment: Mapping[str, str] | None = None,
    module: str = MODULE,
) -> dict[str, Any]:
    """Return time [s], processor time [s], largest process and results folder [bytes] of one `rayproof run`.

    It is started in `folder` by the command line's `module`, which `environment` may say where to find. `place` gets
    its results and its cache.

    Raises:
        GrowthError: the run did not end with 0.

    """
    out = place / RESULTS
    command = [sys.executable, "-c", COMMAND.format(module=module), "run", *arguments, "--out", str(out)]
    variables = {**os.environ, VARIABLE: str(place / "cache"), **(environment or {})}
    start = time.perf_counter()
    with (place / "said").open("wb") as said:
        child = subprocess.Popen(command, cwd=folder, env=variables, stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        try:
            # Its own use of the processor and that of all workers that it waited for; its memory is the largest one's.
            _, status, used = os.wait4(child.pid, 0)
        except BaseException:
            child.terminate()
            child.wait()
            raise
    seconds = time.perf_counter() - start
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        last = (place / "said").read_text(errors="replace").strip().splitlines()[-1:]
        raise GrowthError(f"`run {shlex.join(arguments)}` ended with {child.returncode}: {''.join(last)[:LINE]}")
    return {
        "seconds": seconds,
        "processor_seconds": used.ru_utime + used.ru_stime,
        "peak_bytes": used.ru_maxrss * (1 if sys.platform == "darwin" else 1024),
        "index_bytes": (out / "index.html").stat().st_size,
        "folder_bytes": sum(path.stat().st_size for path in out.rglob("*") if path.is_file()),
    }
