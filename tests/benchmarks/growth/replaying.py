"""Real records, renamed, through the journal, the store and publishing: what the process that keeps a run takes.

What renders is left out, so that a run of any length can be looked at in minutes. Records keep the images and scenes
of the run that they come from.
"""

import json
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypedDict

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.front import SHARD
from rayproof.reports.results.document import load_results, save_results
from rayproof.reports.run import totals
from rayproof.reports.run.totals import come_to
from rayproof.reports.run.workload import Journal

CHECKOUT = Path(__file__).resolve().parents[3]
RECORDS = 1000  # of the run that is replayed, at most
BATCH = 25  # cases that are kept at once, as they come from another machine
START = "import sys; from tests.benchmarks.growth.replaying import main; main(*sys.argv[1:])"


class Replay(TypedDict):
    """What the one process takes that keeps a run of so many cases and publishes it."""

    cases: int
    seconds: float
    processor_seconds: float
    parent_peak_bytes: int
    index_bytes: int  # the size of index.html
    entries: int  # files of the folder of records that has most
    shard: int


class ReplayError(RuntimeError):
    """Records that could not be replayed; one line."""


def replayed(source: Path, counts: Sequence[int], *, folder: Path | None = None) -> Iterator[Replay]:
    """Yield what runs of so many cases take, whose records are those of `source` again and again.

    They are made below `folder`, by default a temporary one.

    Raises:
        ReplayError: such a process failed.

    """
    for count in counts:
        with TemporaryDirectory(prefix="rayproof-replay-", dir=folder) as place:
            words = [sys.executable, "-c", START, str(source.resolve()), str(count), place]
            done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=CHECKOUT)
            if done.returncode != 0:
                raise ReplayError(f"{count} cases: {''.join(done.stderr.strip().splitlines()[-1:])}")
            yield json.loads(done.stdout.splitlines()[-1])


def ratios(rows: Sequence[Replay]) -> dict[str, float]:
    """Return what the longest run takes over the shortest: memory, and processor time and time a case."""
    first, last = min(rows, key=lambda row: row["cases"]), max(rows, key=lambda row: row["cases"])
    share = first["cases"] / last["cases"]
    return {
        "parent_peak": last["parent_peak_bytes"] / first["parent_peak_bytes"],
        "seconds_a_case": share * last["seconds"] / first["seconds"],
        "processor_seconds_a_case": share * last["processor_seconds"] / first["processor_seconds"],
    }


def main(source: str, number: str, place: str) -> None:
    """Replay a run's records under so many names into `place`, and print what it took as JSON."""
    count, out, cpu, start = int(number), Path(place), time.process_time(), time.perf_counter()
    run = load_results(Path(source))
    for name in ("images", "scenes"):
        if (Path(source) / name).is_dir():
            shutil.copytree(Path(source) / name, out / name)
    records = min(RECORDS, len(run["cases"]), count)
    with Journal(out, resume=False) as journal:
        for first in range(0, count, BATCH):
            with journal.together():
                for index in range(first, min(first + BATCH, count)):
                    record = run["cases"][index % records]
                    name = f"{record['family']}/{index:06}"
                    journal.append(name, {**record, "name": name, "key": name, "picture": None})
        families = (run["cases"][index % records]["family"] for index in range(count))
        cases = journal.cases(f"{family}/{index:06}" for index, family in enumerate(families))
    document: Any = {key: value for key, value in run.items() if key not in ("history", "comparison", "diagnosis")}
    document |= come_to(totals.of(cases), planned=count, tracer=True) | {"cases": cases}
    save_results(out, document)
    publish_all(out, document)
    told: Replay = {
        "cases": count,
        "seconds": time.perf_counter() - start,
        "processor_seconds": time.process_time() - cpu,
        "parent_peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        * (1 if sys.platform == "darwin" else 1024),
        "index_bytes": (out / "index.html").stat().st_size,
        "entries": max(
            len(list(path.iterdir())) for path in (out / "data", *(out / "data").iterdir()) if path.is_dir()
        ),
        "shard": SHARD,
    }
    sys.stdout.write(json.dumps(told) + "\n")
