"""Hitting a process of a run: which there are, by what they do, and what is sent to one."""

import random
import resource
import signal
import time
from dataclasses import dataclass

import psutil

from rayproof.reports.processes.signals import descendants

ENDING = ("SIGKILL", "SIGSEGV", "SIGABRT", "SIGTERM", "SIGINT")
STOP, PAUSE, MEMORY = "SIGSTOP", "SIGSTOP and SIGCONT", "memory"
LONGEST_PAUSE = 2.0  # s
ROOM = 2**20  # bytes of address space that a process is left
# The beginnings of what workers' names say after "rayproof-", of which a listing shows six letters.
WORKERS = {
    "tracer": "tracer",
    "judge": "judge",
    "refere": "reference",
    "cache": "cache",
    "exec": "caller",
    "draw": "draw",
}
ENGINE_WORKER, NANNY, SCHEDULER = "engine worker", "nanny", "scheduler"
# By what is in their command.
OF_THE_ENGINE = {"multiprocessing.spawn": ENGINE_WORKER, "-m dask worker": NANNY, "-m dask scheduler": SCHEDULER}
TARGETS = (
    "main", "tracer", "judge", "reference", "cache", "caller", "draw", "keeper", "program", "child", "starting",
    *OF_THE_ENGINE.values(),
)  # fmt: skip
LAST = ("main", SCHEDULER)  # nothing follows them in a run
# Whose deadline is two minutes where another program is under test: too long for a soak to wait for often.
PATIENT = ("judge", "reference", "cache", "caller", "starting")


@dataclass(frozen=True, kw_only=True)
class Signal:
    """What was sent to whom, and when: at a random moment or at a named one."""

    name: str
    target: str
    moment: str

    @property
    def waits(self) -> bool:
        """Say whether a run must wait for a deadline because of it."""
        return self.name in (STOP, MEMORY)


def processes(main: int, *engine: int) -> dict[str, list[psutil.Process]]:
    """Return the processes of a run by what they do: only those below it, and a cluster's and below those."""
    found: dict[str, list[psutil.Process]] = {}
    below = [*descendants(main), *map(psutil.Process, engine), *(one for pid in engine for one in descendants(pid))]
    for process in below:
        try:
            kind = _kind(process.name(), " ".join(process.cmdline()))
        except (psutil.NoSuchProcess, psutil.AccessDenied):
            continue
        if kind is not None:
            found.setdefault(kind, []).append(process)
    return found


def _kind(name: str, command: str) -> str | None:
    if name.startswith("rayproof-"):
        return next((kind for start, kind in WORKERS.items() if name[9:].startswith(start)), None)
    if "keeper.py" in command:
        return "keeper"
    if name == "sleep":
        return "child"
    if "processes.pool import begin" in command or "scene3d.plotting" in command:
        return "starting"
    if name == "program":
        return "program"
    return next((kind for words, kind in OF_THE_ENGINE.items() if words in command), None)


def chosen(rng: random.Random, target: str, *, patient: bool) -> str:
    """Return what to send to a target; `patient` says that another program is under test."""
    if target == "main":
        return rng.choice((*ENDING, PAUSE, MEMORY))
    if target in (NANNY, SCHEDULER):
        return rng.choice((*ENDING, PAUSE))
    if patient and target in PATIENT:
        return rng.choice((*ENDING, PAUSE))
    return rng.choice((*ENDING, *ENDING, STOP, PAUSE, MEMORY))


def hit(process: psutil.Process, name: str, rng: random.Random) -> bool:
    """Send it; say whether the process was there to get it."""
    try:
        if not process.is_running() or process.status() == psutil.STATUS_ZOMBIE:
            return False
        if name == MEMORY:
            used = process.memory_info().vms + ROOM
            process.rlimit(resource.RLIMIT_AS, (used, used))
        elif name == PAUSE:
            process.send_signal(signal.SIGSTOP)
            time.sleep(rng.uniform(0.1, LONGEST_PAUSE))
            process.send_signal(signal.SIGCONT)
        else:
            process.send_signal(getattr(signal, name))
    except (psutil.NoSuchProcess, psutil.AccessDenied):
        return False
    return True
