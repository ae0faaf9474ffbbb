"""The cluster on which a soak's run takes place: one that the run makes itself, or processes of the soak's own.

Those are a scheduler and workers as somebody deploys them by hand, each worker below a nanny. What ends of the workers
is started anew, as a deployer would.
"""

import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from rayproof.reports.processes.signals import end_below
from rayproof.reports.run.engine.cluster import FILES, LIFETIME, LOCAL

STARTING = 60.0  # s within which a scheduler says where it is
PARTING = 10.0  # s that a process has to end once it is told to


class Engine:
    """A scheduler and workers, as processes; `words` are the options of a run that uses them."""

    def __init__(self, folder: Path, environment: Mapping[str, str], workers: int) -> None:
        from distributed import Security

        folder.mkdir()
        lifetime = {"DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": f"{LIFETIME}s"}
        self._environment = {**environment, **lifetime, "DASK_TEMPORARY_DIRECTORY": str(folder)}
        made: Any = Security.temporary()
        authority, certificate, key = (folder / name for name in FILES)
        authority.write_text(made.tls_ca_file)
        certificate.write_text(made.tls_client_cert)
        key.write_text(made.tls_client_key)
        self._tls = ("--tls-ca-file", authority, "--tls-cert", certificate, "--tls-key", key)
        where = folder / "where.json"
        about = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0", "--scheduler-file", where)
        self._scheduler = self._started("scheduler", *about)
        self._address = self._told(where)
        self._workers = [self._worker() for _ in range(workers)]
        self.words = ("--scheduler", self._address, "--tls", str(folder))

    @property
    def pids(self) -> list[int]:
        """Return the processes that were started here and still run."""
        return [one.pid for one in (self._scheduler, *self._workers) if one.poll() is None]

    def mend(self) -> None:
        """Start a worker for each that has ended."""
        self._workers = [one if one.poll() is None else self._worker() for one in self._workers]

    def close(self) -> None:
        """Tell all to end, and end those that do not."""
        for one in (*self._workers, self._scheduler):
            one.terminate()
        psutil.wait_procs([psutil.Process(pid) for pid in self.pids], timeout=PARTING)
        for one in (*self._workers, self._scheduler):
            end_below(one.pid)
            one.kill()
            one.wait()

    def _worker(self) -> "subprocess.Popen[bytes]":
        about = ("--nthreads", "1", "--no-dashboard", "--memory-limit", "0")
        return self._started("worker", self._address, *about)

    def _started(self, role: str, *arguments: object) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [sys.executable, "-m", "dask", role, *map(str, arguments), *map(str, self._tls)],
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def _told(self, where: Path) -> str:
        until = time.monotonic() + STARTING
        while time.monotonic() < until:
            try:
                return str(json.loads(where.read_text(encoding="utf-8"))["address"])
            except (OSError, ValueError):
                time.sleep(0.1)
        self._scheduler.kill()
        raise RuntimeError(f"no scheduler of the engine started within {STARTING:g} s")


def made_by_the_run(workers: int) -> tuple[str, ...]:
    """Return the options of a run that makes a cluster of so many workers itself; none for no workers."""
    return ("--scheduler", f"{LOCAL}{workers}") if workers else ()


@contextmanager
def engine(folder: Path, environment: Mapping[str, str], workers: int) -> Iterator[Engine]:
    """Yield a cluster of the soak's own, whose files are in a folder; it ends with the block."""
    one = Engine(folder, environment, workers)
    try:
        yield one
    finally:
        one.close()
