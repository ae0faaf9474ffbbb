"""The connection to a Dask scheduler by mutual TLS, or a cluster on this machine.

Dask unpickles its messages, so that every client of a scheduler can execute code on all of its workers and in all
connected runs. Therefore both ends present a certificate of the same authority, also for a cluster on this machine,
since its other users can reach the loopback address.
"""

import atexit
import contextlib
import logging
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from typing import Any

from rayproof.reports.processes.signals import deaf

LOCAL, MOST_LOCAL = "local:", 64  # workers of a cluster on this machine
FILES = ("ca.pem", "cert.pem", "key.pem")  # the authority's certificate, and this end's own with its key
CONNECTING, WAIT = 10.0, 60.0  # s within which a scheduler answers, and a worker comes
ENDING = 20.0  # s for a client or a cluster to close; a worker that is stopped is killed after 4 s
LIFETIME = 60.0  # s without a heartbeat after which a worker of a cluster on this machine is started again


@dataclass(frozen=True, kw_only=True)
class ClusterAddress:
    """The address of a run's scheduler."""

    address: str  # "local:N", or "tls://HOST:PORT"
    tls: Path | None = None  # the folder with FILES

    @property
    def local(self) -> int:
        """Return the number of workers of a cluster on this machine, or 0 for a scheduler elsewhere."""
        return int(self.address.removeprefix(LOCAL)) if self.address.startswith(LOCAL) else 0


def checked(place: ClusterAddress) -> ClusterAddress:
    """Return the address if it is valid; raise ValueError for a wrong address or folder of certificates."""
    address, number = place.address, place.address.removeprefix(LOCAL)
    if address.startswith(LOCAL):
        if not number.isascii() or not number.isdigit() or not 1 <= int(number) <= MOST_LOCAL or place.tls is not None:
            raise ValueError(f"--scheduler {address}: local:N starts N workers, 1 to {MOST_LOCAL}, and takes no --tls")
        return place
    if not address.startswith("tls://") or ":" not in address.removeprefix("tls://"):
        expected = "an address is tls://HOST:PORT, or local:N for N workers here"
        raise ValueError(f"--scheduler {address}: {expected}; in plain text anybody who reaches it owns every worker")
    if place.tls is None:
        raise ValueError(f"--scheduler {address}: --tls names the folder with {', '.join(FILES)}")
    if missing := [name for name in FILES if not (place.tls / name).is_file()]:
        raise ValueError(f"--tls {place.tls}: there is no file {missing[0]}")
    return place


@contextlib.contextmanager
def reached(place: ClusterAddress) -> Iterator[Any]:
    """Yield a client of a scheduler that has a worker; raise ValueError, with one line of text, if there is none."""
    import distributed

    for name in [*logging.root.manager.loggerDict]:  # their messages would appear between the run's lines
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    with contextlib.ExitStack() as stack:
        address = place.address
        try:
            if place.tls is None:
                security = distributed.Security.temporary()
                address = stack.enter_context(_local(place.local, security))
            else:
                authority, certificate, key = (str(place.tls / name) for name in FILES)
                files = {"tls_ca_file": authority, "tls_client_cert": certificate, "tls_client_key": key}
                security = distributed.Security(require_encryption=True, **files)
            about = {"security": security, "timeout": CONNECTING, "set_as_default": False, "name": "rayproof"}
            client = distributed.Client(address, **about)
            stack.callback(_close, client)
            client.wait_for_workers(1, timeout=WAIT)
        except (OSError, ValueError, RuntimeError) as error:
            needs = f"; all ends need valid certificates of the authority in {place.tls}" if place.tls else ""
            why = str(error.__cause__ or "") or error  # a timeout has no message
            raise ValueError(f"--scheduler {place.address}: {why}{needs}") from None
        yield client


@contextlib.contextmanager
def _local(number: int, security: Any) -> Iterator[str]:
    """Yield the address of a cluster of this machine."""
    import dask.config
    from distributed import LocalCluster
    from distributed.deploy.spec import close_clusters
    from distributed.utils import LoopRunner

    folder, runner = tempfile.gettempdir(), LoopRunner()
    # It warns of a cluster that is stopped during its start; the workers are daemonic.
    atexit.unregister(close_clusters)
    ensure_running()  # here: a thread that starts multiprocessing's tracker unblocks Ctrl-C
    with deaf():  # the workers inherit it from the runner's thread: only this process handles Ctrl-C
        runner.start()
    settings = {"worker-ttl": f"{LIFETIME}s", "allowed-failures": 1, "http.routes": ()}
    settings = {f"distributed.scheduler.{name}": value for name, value in settings.items()}
    settings["distributed.worker.http.routes"] = ()  # as above: no status pages, which would be served in plain text
    size: dict[str, Any] = {"n_workers": number, "threads_per_worker": 1, "memory_limit": 0}
    # Without an address the scheduler would serve its status pages on all addresses, always at the same port.
    pages: dict[str, Any] = {"dashboard_address": None, "scheduler_kwargs": {"dashboard_address": "127.0.0.1:0"}}
    # This process removes the folder at its end, even if workers were killed.
    places: dict[str, Any] = {"local_directory": folder, "env": {"TMPDIR": folder}, "loop": runner.loop}
    with contextlib.ExitStack() as stack:
        stack.callback(runner.stop)
        stack.enter_context(dask.config.set(settings))
        cluster = LocalCluster(security=security, silence_logs=logging.CRITICAL, **size, **pages, **places)
        stack.callback(_close, cluster)
        yield cluster.scheduler_address


def _close(opened: Any) -> None:
    """Close a client or a cluster; its other end may have gone."""
    with contextlib.suppress(Exception):
        opened.close(timeout=ENDING)
