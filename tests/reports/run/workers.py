"""Workers for the pool's tests: one does as it is told, and dies when told to; others sleep or compute."""

import os
import pickle
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rayproof.reports.processes.worker import LENGTH, PREPARE, Channel, Reply, serve


def obey(kind: str, connection: Channel) -> None:
    """Answer each task by doing it: echo, die, hang or leave, at once or afterwards."""
    while True:
        try:
            task = connection.recv()
        except EOFError:
            return
        if task is PREPARE:
            continue
        with tempfile.NamedTemporaryFile(delete=False) as left:
            left.write(b"whoever is killed removes nothing")
        if task == "die":
            os.kill(os.getpid(), signal.SIGABRT)
        if task == "leave":
            os._exit(3)
        if task == "hang":
            time.sleep(60)
        if task == "fill":
            filled = bytearray(os.urandom(2**20) * 300)
            time.sleep(60 + len(filled) * 0)
        if task == "nap":
            time.sleep(2)
        if isinstance(task, Path):  # whoever comes first waits for the second
            try:
                task.touch(exist_ok=False)
            except FileExistsError:
                task.with_suffix(".second").touch()
            while not task.with_suffix(".second").exists():
                time.sleep(0.01)
        if task == "stop":
            os.kill(os.getpid(), signal.SIGSTOP)
        if task == "stop amid the reply":
            packed = pickle.dumps(Reply(value=bytes(2**23), error=None, trace=None, seconds=0.0))
            connection._end.sendall(LENGTH.pack(len(packed)) + packed[: len(packed) // 2])
            os.kill(os.getpid(), signal.SIGSTOP)
        if task == "pid":
            connection.send(Reply(value=os.getpid(), error=None, trace=None, seconds=0.0))
            continue
        if isinstance(task, bytes):
            connection.send(Reply(value=task, error=None, trace=None, seconds=0.0))
            continue
        connection.send(Reply(value=(kind, task), error=None, trace=None, seconds=0.0))
        if task == "answer and leave":
            os._exit(3)


def _sleep_or_compute(kind: str) -> Callable[[float], str]:
    def work(seconds: float) -> str:
        if kind == "sleeps":
            time.sleep(seconds)
        end = time.process_time() + seconds
        while kind == "computes" and time.process_time() < end:
            pass
        return kind

    return work


def sleep_or_compute(kind: str, connection: Channel) -> None:
    """Sleep, or compute, for as many seconds as each task says."""
    serve(kind, connection, _sleep_or_compute)
