"""The cluster that a run works on: a Dask scheduler reached with mutual TLS, or one of this machine for trying it.

Whoever reaches a scheduler of this engine owns every worker and whoever is connected, since it pickles. So both ends
show a certificate of one authority, also on one machine, whose other users reach its loopback too.

This module alone imports the engine's packages, and they are imported when a cluster is asked for.
"""

import asyncio
import atexit
import contextlib
import logging
import queue
import socket
import ssl
import sys
import tempfile
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rayproof.reports.processes.signals import deaf

if TYPE_CHECKING:
    from distributed import Client, Security
    from distributed import Future as TaskFuture

LOCAL = "local:"
SCHEME = "tls://"
CONNECTING = 10.0  # s within which a scheduler answers
MOST_LOCAL = 64  # workers of a cluster on this machine
LOOK = 1.0  # s between looks at which workers there are
LATE = 5.0  # s that a scheduler may take to say so
PARTING = 5.0  # s for workers to be told that a run is over
ENDING = 20.0  # s for a cluster of this machine to end; one of its workers that is stopped is killed after 4 s
QUIET = "ignore::UserWarning:multiprocessing.resource_tracker"
# What the engine's processes serve in plain text by themselves, of their state, to whoever asks.
PAGES = ("distributed.scheduler.http.routes", "distributed.worker.http.routes")


class ClusterError(ValueError):
    """A cluster cannot be used; the message is one line that says why."""


@dataclass(frozen=True, kw_only=True)
class Credentials:
    """A folder with files in PEM: the authority's certificate, and this end's own with its key."""

    folder: Path

    @property
    def authority(self) -> Path:
        """Return the authority's certificate."""
        return self.folder / "ca.pem"

    @property
    def certificate(self) -> Path:
        """Return this end's certificate."""
        return self.folder / "cert.pem"

    @property
    def key(self) -> Path:
        """Return the key of this end's certificate."""
        return self.folder / "key.pem"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a run's scheduler is."""

    address: str  # "local:N", or "tls://HOST:PORT"
    credentials: Credentials | None = None

    @property
    def local(self) -> int:
        """Return how many workers a cluster on this machine has, or 0 for one elsewhere."""
        return int(self.address.removeprefix(LOCAL)) if self.address.startswith(LOCAL) else 0


@dataclass(frozen=True, kw_only=True)
class Event:
    """What happened to a task that was sent, or to the cluster."""

    task: str  # its name; empty: the cluster itself
    value: Any = None  # what it returned, or of the cluster the workers that there are
    error: BaseException | None = None  # what it raised
    lost: str | None = None  # why there is no answer and will be none


@dataclass(frozen=True, kw_only=True)
class WorkerState:
    """A worker as its scheduler knows it."""

    name: str
    host: str
    last_seen: float  # by the scheduler's clock


def checked(place: Place) -> Place:
    """Return the place; raise ClusterError for an address or credentials that cannot be meant."""
    address = place.address
    if address.startswith(LOCAL):
        number = address.removeprefix(LOCAL)
        if not number.isascii() or not number.isdigit() or not 1 <= int(number) <= MOST_LOCAL:
            raise ClusterError(f"--scheduler {address}: local:N starts N workers, from 1 to {MOST_LOCAL}")
        if place.credentials is not None:
            raise ClusterError(f"--scheduler {address} makes its own certificates; --tls is for others")
        return place
    if not address.startswith(SCHEME) or ":" not in address.removeprefix(SCHEME):
        raise ClusterError(
            f"--scheduler {address}: an address is tls://HOST:PORT, or local:N for N workers here; in plain text "
            "anybody who reaches it owns every worker and this process"
        )
    if place.credentials is None:
        raise ClusterError(f"--scheduler {address}: --tls names the folder with ca.pem, cert.pem and key.pem")
    _check(place.credentials)
    return place


def _check(credentials: Credentials) -> None:
    """Raise ClusterError for files that are no certificates, or no longer any."""
    certificates = (credentials.authority, credentials.certificate)
    for path in (*certificates, credentials.key):
        try:
            path.read_bytes()
        except OSError as error:
            raise ClusterError(f"--tls: {path}: {error.strerror}") from None
    for path in certificates:
        until = _valid_until(path)
        if until < datetime.now(UTC):
            raise ClusterError(f"--tls: {path}: the certificate expired on {until:%Y-%m-%d}")
    try:
        context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH, cafile=str(credentials.authority))
        context.load_cert_chain(credentials.certificate, credentials.key)
    except (ssl.SSLError, OSError) as error:
        raise ClusterError(
            f"--tls: {credentials.certificate} and {credentials.key} do not belong together: {error}"
        ) from None


def _valid_until(path: Path) -> datetime:
    from cryptography import x509

    try:
        return x509.load_pem_x509_certificate(path.read_bytes()).not_valid_after_utc
    except ValueError:
        raise ClusterError(f"--tls: {path}: is no certificate in PEM") from None


class Cluster:
    """A scheduler that answered; tasks go to named workers, and what becomes of them comes as events."""

    def __init__(self, client: "Client", *, local: int) -> None:
        self.local = local
        self._client: Any = client
        self._events: queue.Queue[Event] = queue.Queue()
        self._futures: dict[str, TaskFuture] = {}
        self._looking = self._soon(self._look())

    @property
    def version(self) -> str:
        """Return the engine's version."""
        from importlib.metadata import version

        return version("distributed")

    def send(self, task: str, function: Callable[..., Any], *arguments: Any, worker: str) -> None:
        """Have a worker call a function; its answer, or why there is none, comes as an event of this task's name.

        Nobody else takes it over where the worker is lost: who is to blame only the run can tell.
        """
        future = self._client.submit(
            function, *arguments, key=task, workers=[worker], allow_other_workers=False, pure=False, retries=0
        )
        self._futures[task] = future
        self._soon(self._wait(task, future))

    def forget(self, task: str) -> None:
        """Let a task go: its answer, should one still come, is nobody's."""
        future = self._futures.pop(task, None)
        if future is not None and self.alive:
            with contextlib.suppress(Exception):  # a scheduler that has gone knows nothing of it anyway
                self._soon(self._client._cancel([future], force=True))

    def next(self, seconds: float) -> Event | None:
        """Return what happened next, or None if nothing did for so long."""
        try:
            return self._events.get(timeout=seconds)
        except queue.Empty:
            return None

    @property
    def alive(self) -> bool:
        """Say whether the scheduler is there."""
        return self._client.status == "running"

    def tell_all(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have every worker call a function beside its tasks, as far as they answer."""

        async def told() -> None:
            with contextlib.suppress(Exception):
                call = self._client._run(function, *arguments, on_error="ignore")
                await asyncio.wait_for(call, PARTING)

        if self.alive:
            with contextlib.suppress(Exception):
                self._soon(told()).result(2 * PARTING)

    def close(self) -> None:
        """Leave the scheduler."""
        self._looking.cancel()
        self._futures.clear()
        with contextlib.suppress(Exception):  # it may be gone, and so may what it held
            self._client.close(timeout=PARTING)

    def _soon(self, what: Coroutine[Any, Any, None]) -> "Future[None]":
        """Have the client's own thread do something."""
        return asyncio.run_coroutine_threadsafe(what, self._client.loop.asyncio_loop)

    async def _wait(self, task: str, future: Any) -> None:
        try:
            await future._state.wait()
            if future.status == "error":
                event = self._failed(task, await future._exception())
            elif future.status != "finished":
                event = Event(task=task, lost=f"the engine says {future.status!r} of it")
            else:
                value = (await self._client._gather([future]))[0]
                event = Event(task=task, value=value)
        except BaseException as error:
            event = Event(task=task, lost=f"{type(error).__name__}: {error}".splitlines()[0])
        self._events.put(event)

    @staticmethod
    def _failed(task: str, error: BaseException | None) -> Event:
        from distributed import KilledWorker

        if error is None or isinstance(error, KilledWorker | asyncio.CancelledError):
            return Event(task=task, lost=str(error or "it failed without a word"))
        return Event(task=task, error=error)

    async def _look(self) -> None:
        """Tell again and again which workers there are, or that the scheduler has gone."""
        while self.alive:
            try:
                info = await asyncio.wait_for(self._client.scheduler.identity(n_workers=-1), LATE)
            except Exception as error:
                if not self.alive:
                    break
                # Slow once is not gone; its connection tells that.
                logging.getLogger(__name__).debug("no answer: %s", error)
            else:
                found = {
                    address: WorkerState(
                        name=str(one.get("name")), host=str(one.get("host")), last_seen=float(one.get("last_seen", 0.0))
                    )
                    for address, one in info["workers"].items()
                }
                self._events.put(Event(task="", value=found))
            await asyncio.sleep(LOOK)
        self._events.put(Event(task="", lost="the scheduler has gone"))


@contextmanager
def reached(place: Place) -> Iterator[Cluster]:
    """Yield the cluster at a place; one on this machine is started, and ends with the body.

    Raises:
        ClusterError: the engine is not installed, or the scheduler cannot be used.

    """
    try:
        import distributed
    except ImportError:
        raise ClusterError(
            "--scheduler needs Dask distributed, which is not installed: ./rayproof install dask"
        ) from None
    checked(place)
    for name in [*logging.root.manager.loggerDict]:  # their words would stand between the run's lines
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    with contextlib.ExitStack() as stack:
        if place.local:
            security = distributed.Security.temporary()
            address = stack.enter_context(_local(place.local, security))
        else:
            address, security = place.address, _security(place.credentials)
        try:
            client = distributed.Client(
                address, security=security, timeout=CONNECTING, set_as_default=False, name="rayproof"
            )
        except (OSError, ValueError, RuntimeError, TimeoutError) as error:
            raise ClusterError(f"--scheduler {place.address}: {_why(error, address)}") from None
        cluster = Cluster(client, local=place.local)
        stack.callback(cluster.close)
        yield cluster


def _security(credentials: Credentials | None) -> "Security":
    from distributed import Security

    if credentials is None:
        return Security(require_encryption=False)
    return Security(
        require_encryption=True,
        tls_ca_file=str(credentials.authority),
        tls_client_cert=str(credentials.certificate),
        tls_client_key=str(credentials.key),
    )


def written_credentials(folder: Path) -> Credentials:
    """Return files, below a folder that nobody else may read, of a new authority that vouches for itself alone."""
    from distributed import Security

    made: Any = Security.temporary()
    files = Credentials(folder=folder)
    files.authority.write_text(made.tls_ca_file)
    files.certificate.write_text(made.tls_client_cert)
    files.key.write_text(made.tls_client_key)
    return files


@contextmanager
def _local(number: int, security: "Security") -> Iterator[str]:
    """Yield the address of a cluster of this machine, with certificates of its own."""
    import dask.config
    from distributed import LocalCluster
    from distributed.deploy.spec import close_clusters
    from distributed.utils import LoopRunner

    folder = tempfile.gettempdir()
    atexit.unregister(close_clusters)  # it complains of one that is stopped while it starts; its workers are daemonic
    runner = LoopRunner()
    _start_tracker()  # here: where it is started by whoever needs it first, that thread hears Ctrl-C again
    with deaf():  # and so are the workers, which are started from the runner's thread: Ctrl-C is for this process
        runner.start()
    with contextlib.ExitStack() as stack:
        stack.callback(runner.stop)
        stack.enter_context(dask.config.set(dict.fromkeys(PAGES, ())))
        try:
            cluster: Any = LocalCluster(
                loop=runner.loop,
                n_workers=number,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                protocol="tls://",
                security=security,
                dashboard_address=None,  # pyright: ignore[reportArgumentType]  none is served
                worker_dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # else the same port of all addresses, always
                memory_limit=0,
                silence_logs=logging.CRITICAL,
                local_directory=folder,
                env={"TMPDIR": folder},  # which ends with this process's, also where workers were killed
            )
        except (OSError, RuntimeError, TimeoutError) as error:
            raise ClusterError(f"--scheduler {LOCAL}{number}: no cluster started here: {_why(error)}") from None
        stack.callback(_closed, cluster)
        yield cluster.scheduler_address


def _start_tracker() -> None:
    """Start the process that removes the semaphores of a cluster that is stopped while it starts, without a warning.

    A thread may make one after the main one has cleared up. It is removed all the same, and nobody need do anything.
    """
    sys.warnoptions.append(QUIET)  # which the new process gets
    try:
        ensure_running()
    finally:
        sys.warnoptions.remove(QUIET)


def _closed(cluster: Any) -> None:
    with contextlib.suppress(Exception):
        cluster.close(timeout=ENDING)


def _why(error: BaseException, address: str = "") -> str:
    """Return in a few words why there is no connection to an address."""
    seen: list[str] = []
    one: BaseException | None = error
    while one is not None:
        seen.append(" ".join(str(one).split()))
        one = one.__cause__ or one.__context__
    text = " ".join(seen)
    if "expired" in text:
        return "the scheduler's certificate has expired"
    if "CERTIFICATE_VERIFY_FAILED" in text or "certificate verify failed" in text:
        return "the scheduler's certificate is not of the authority that --tls names"
    if "alert" in text.lower() and "ca" in text.lower():
        return "the scheduler does not take the certificate that --tls names"
    if "EOF occurred in violation of protocol" in text:
        # The alert that says why can be lost when the other side closes at once.
        return "the scheduler ended the connection, as it does if it does not take the certificate that --tls names"
    if "refused" in text.lower() or _refuses(address):
        return "nobody listens there"
    if "timed out" in text.lower() or isinstance(error, TimeoutError):
        return f"it did not answer within {CONNECTING:g} s"
    return seen[0] or type(error).__name__


def _refuses(address: str) -> bool:
    """Say whether nobody listens at an address: that the engine was refused can be lost while it tries again."""
    if not address:
        return False
    from distributed.comm.addressing import get_address_host_port

    try:
        with socket.create_connection(get_address_host_port(address), timeout=CONNECTING):
            return False
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
