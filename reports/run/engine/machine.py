"""On a cluster's worker: batches go through a pool of processes; records and files are packed and returned.

A record must not depend on the machine that made it: a worker refuses a batch if its software or processor differs from
the calling machine's. Batches contain the scenes and results contain the files, so that no disk is shared. The
processes, with imported renderers and compiled kernels, are kept for all batches of a run.
"""

import json
import multiprocessing
import os
import pickle
import platform
import threading
import time
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from multiprocessing.util import Finalize
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory

from rayproof.reports.processes.scratch import Scratch, sweep
from rayproof.reports.processes.signals import end_with_parent
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.compact import compact_case, expand_case
from rayproof.reports.results.files import as_json
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.case_pipeline import LocalCases, finished
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.reference_cache import PACKAGES, code, processor
from rayproof.reports.run.scenes import place_of
from rayproof.reports.run.verdict_memory import version as reference_version
from rayproof.reports.run.workers import RELIEF, workers
from rayproof.reports.subjects.choosing import identity
from rayproof.tracer.kernel.compiler import VARIABLE, choose_packaged_llvm, packaged_library

IDLE = 60.0  # s without a batch after which the processes end: the run that sent the last one may be gone
GLANCE = 1.0  # s between checks whether the run is over
Cases = tuple[PlannedCase, ...]
Finished = tuple[bytes, Mapping[str, bytes]]  # a case's record as deflated JSON, and its files by relative path


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Whole cases for one worker, and the limits of its processes."""

    options: CaseOptions
    timeout: float  # s, for one render or one judgement
    memory: float = float("inf")  # bytes of a process
    jobs: int | None = None  # processes at once; None: one per processor of that machine
    cases: Cases = ()


@dataclass(frozen=True, kw_only=True)
class BatchResult:
    """The records of a batch by the cases' names, or the reason why a worker refused it."""

    worker: str  # its address
    finished: Mapping[str, Finished] = field(default_factory=dict)
    seconds: float = 0.0  # of the whole batch
    refused: str = ""


def packed(name: str, record: CaseRecord, folder: Path) -> Finished:
    """Return a case's record with its files below `folder`."""
    place = place_of(name)
    paths = [folder / f"scenes/{place}.json", folder / f"images/{place}.js"]
    paths += sorted((folder / "images" / place).rglob("*"))
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths if path.is_file()}
    return zlib.compress(as_json(compact_case(record)).encode()), files


def unpacked(finished: Finished, folder: Path) -> CaseRecord:
    """Write a case's files below a results folder, and return its record."""
    write(finished[1], folder)
    return expand_case(json.loads(zlib.decompress(finished[0])))


def write(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files below a folder; raise OSError on failure."""
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def facts(options: CaseOptions) -> dict[str, str]:
    """Return the facts of this machine that can change the records of a run with these options."""
    architecture, model, features = processor()
    library, packaged = os.environ.get(VARIABLE, ""), packaged_library()
    usual = packaged is not None and library in ("", str(packaged))  # its path differs between machines
    machine_facts = {"rayproof's code": code(tracer=True), "Python": platform.python_version()}
    machine_facts |= {package: version(package) for package in PACKAGES}
    machine_facts |= {"architecture": architecture, "processor": model, "processor features": features}
    machine_facts["LLVM"] = version("karellen-llvm-core") if usual else library
    machine_facts["RAYPROOF_BACKEND"] = os.environ.get("RAYPROOF_BACKEND", "")
    machine_facts["program under test"] = " ".join(identity(options.subject)) if options.subject.is_program else ""
    return machine_facts | {f"reference {name}": reference_version(name) for name in options.references}


def difference(caller: Mapping[str, str], here: Mapping[str, str]) -> str:
    """Return in words the first fact `here`, on the worker, that differs from the caller's, or an empty string."""
    for name, value in here.items():
        if value != caller.get(name):
            words, wanted = set(value.split()), set(caller.get(name, "").split())
            worker_words, caller_words = (
                " ".join(sorted(more))[:80] or "no more" for more in (words - wanted, wanted - words)
            )
            return f"{name}: {worker_words} there, {caller_words} here"
    return ""


class _Machine:
    """The processes of one run on this machine."""

    def __init__(self, run: str, batch: Batch) -> None:
        import dask.config

        _end()
        choose_packaged_llvm()
        # Dask sets how many threads libraries have; renderers need the same environment as without it.
        for name, value in dict(dask.config.get("distributed.nanny.pre-spawn-environ", {})).items():
            if os.environ.get(str(name)) == str(value):
                del os.environ[str(name)]
        self.scratch, self.run, self.last = Scratch(), run, time.monotonic()
        folder = self.scratch.folder
        sweep(folder.parent)
        copies = []
        for number, source in enumerate(batch.options.sources):  # the user's own formulas, each in a folder of its own
            write(source.files, folder / f"formula-{number}")
            copies.append((source.path, str(folder / f"formula-{number}" / PurePath(source.path).name)))
        self._options = replace(batch.options, copies=tuple(copies))
        allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        self.pool = workers(batch.options.subject, jobs=batch.jobs or allowed, timeout=batch.timeout, folder=folder)
        self.pool.memory, self.pool.relief = batch.memory, RELIEF
        self._store = usual_store() if batch.options.cached else None
        if (nanny := multiprocessing.parent_process()) is not None and nanny.pid is not None:
            end_with_parent(nanny.pid)  # Dask's thread for this does not run while a worker is stopped
        Finalize(None, _end, exitpriority=10)
        threading.Thread(target=_watch, args=(self,), daemon=True).start()
        _KEPT[run] = self

    def finished(self, batch: Batch) -> dict[str, Finished]:
        """Return the packed records of a batch by case; raise RuntimeError if the run was stopped meanwhile."""
        done: dict[str, Finished] = {}
        with TemporaryDirectory(dir=self.scratch.folder) as name:
            engine = LocalCases(self._options, self.pool, folder=Path(name), store=self._store)
            for result in finished(engine, batch.cases):
                if result is not None:
                    planned, record = result
                    done[planned.case.name] = packed(planned.case.name, record, Path(name))
                elif self.run in _STOPPED:
                    raise RuntimeError("the run is over")
        self.last = time.monotonic()
        return done


_STOPPED: set[str] = set()  # runs that are over
_KEPT: dict[str, _Machine] = {}  # by run; at most one
_LOCK = threading.Lock()  # one batch at a time, however many threads a worker has


def work(run: str, caller: Mapping[str, str], pickled: bytes) -> BatchResult:
    """Do a batch of a run as Dask's task, or refuse it if this machine's facts differ from the caller's.

    The batch is unpickled here, since another version of the code may be unable to do so.
    """
    from distributed import get_worker

    start, answer = time.perf_counter(), BatchResult(worker=get_worker().address)
    with _LOCK:
        try:
            batch: Batch = pickle.loads(pickled)
            if run not in _KEPT and (refused := difference(caller, facts(batch.options))):
                return replace(answer, refused=refused)
            finished = (_KEPT.get(run) or _Machine(run, batch)).finished(batch)
        except Exception as error:  # this machine cannot work; the failure of a renderer is a result
            _end()
            return replace(answer, refused=" ".join(f"{type(error).__name__}: {error}".split()))
    return replace(answer, finished=finished, seconds=time.perf_counter() - start)


def _watch(machine: _Machine) -> None:
    """End a run's processes when it is over, or after `IDLE` seconds without a batch."""
    over = False
    while not over:
        time.sleep(GLANCE)
        with _LOCK:
            over = machine.run in _STOPPED or time.monotonic() - machine.last > IDLE
            if over and machine in _KEPT.values():
                _end()


def _end() -> None:
    while _KEPT:
        _, machine = _KEPT.popitem()
        machine.pool.close()
        machine.scratch.remove()


def stop(run: str) -> None:
    """Mark a run as over, so that its processes on this machine end."""
    _STOPPED.add(run)
