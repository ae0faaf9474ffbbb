"""A worker's main loop, and `Channel`: pickled messages over a pair of sockets.

A worker's end of a channel waits: for tasks, and for space in the socket for its replies. The pool's end must not wait:
a worker that is stopped reads nothing and may have sent half a message, so waiting for it would never end. The pool
sends and reads as much as the socket's buffers allow, and continues when `poll` reports more.
"""

import contextlib
import os
import pickle
import socket
import struct
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

LENGTH = struct.Struct("<Q")  # in front of each message
AT_ONCE = getattr(socket, "MSG_DONTWAIT", 0)


class Channel:
    """One end of a channel; the descriptor of the other end may be passed to a process that is being started."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self._unsent = memoryview(b"")
        self._head = bytearray(LENGTH.size)
        self._body: bytearray | None = None  # once its length is known
        self._filled = 0  # bytes of head or body

    @classmethod
    def of(cls, descriptor: int) -> "Channel":
        """Return the end that a new process got from its parent; its own child processes do not inherit it."""
        os.set_inheritable(descriptor, False)
        return cls(socket.socket(fileno=descriptor))

    def fileno(self) -> int:
        """Return the descriptor for `poll`."""
        return self._end.fileno()

    def close(self) -> None:
        """Close this end."""
        self._end.close()

    def send(self, message: Any) -> None:
        """Send a message, waiting for space if necessary; raise OSError if the other end has closed."""
        self._end.sendall(_packed(message))

    def recv(self) -> Any:
        """Wait for a message; raise EOFError if the other end has closed."""
        self._take(0)
        return self._message()

    def post(self, message: Any) -> None:
        """Send as much of a message as possible without waiting; raise OSError if the other end has closed."""
        self._unsent = memoryview(bytes(self._unsent) + _packed(message) if self._unsent else _packed(message))
        self.flush()

    @property
    def unsent(self) -> bool:
        """Return whether a part of a posted message is not yet sent."""
        return bool(self._unsent)

    def flush(self) -> None:
        """Send as much of the unsent part as possible without waiting; raise OSError if the other end has closed."""
        while self._unsent:
            try:
                self._unsent = self._unsent[self._end.send(self._unsent, AT_ONCE) :]
            except BlockingIOError:
                return

    def receive(self) -> tuple[bool, Any]:
        """Return whether a whole message has arrived, and the message; raise EOFError if the other end has closed."""
        try:
            self._take(AT_ONCE)
        except BlockingIOError:
            return False, None
        return True, self._message()

    def _take(self, flags: int) -> None:
        """Read until a message is complete."""
        if self._body is None:
            self._fill(self._head, flags)
            self._body, self._filled = bytearray(LENGTH.unpack(self._head)[0]), 0
        self._fill(self._body, flags)

    def _fill(self, buffer: bytearray, flags: int) -> None:
        view = memoryview(buffer)
        while self._filled < len(buffer):
            count = self._end.recv_into(view[self._filled :], 0, flags)
            if count == 0:
                raise EOFError
            self._filled += count

    def _message(self) -> Any:
        body, self._body, self._filled = self._body, None, 0
        return pickle.loads(body or b"")


def channels() -> tuple[Channel, Channel]:
    """Return the two ends of a new channel."""
    first, second = socket.socketpair()
    return Channel(first), Channel(second)


def _packed(message: Any) -> bytes:
    packed = pickle.dumps(message, protocol=5)
    return LENGTH.pack(len(packed)) + packed


PREPARE = None  # in place of a task: do the imports of the first task, without a reply


@dataclass(frozen=True, kw_only=True)
class Reply:
    """The reply of a worker: a value, or an error and its traceback."""

    value: Any
    error: str | None
    trace: str | None
    seconds: float
    stopped: bool = False  # by a time limit, not by an error
    computed: float | None = None  # s of processor time, its programs included; None: unknown


def _processor_time() -> float:
    """Return the processor time of this process and of the programs that it has called [s]."""
    return sum(os.times()[:4])


def serve(kind: str, connection: Channel, handlers: Callable[[str], Callable[[Any], Any]]) -> None:
    """Reply to tasks until the other end closes; `handlers` returns the function that does tasks of `kind`."""
    handler: Callable[[Any], Any] | None = None
    while True:
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        start, before = time.perf_counter(), _processor_time()
        if task is PREPARE:
            with contextlib.suppress(Exception):  # the first task raises it again, and its reply reports it
                handler = handlers(kind)
            continue
        try:
            handler = handler or handlers(kind)
            reply = Reply(value=handler(task), error=None, trace=None, seconds=time.perf_counter() - start)
        except Exception as error:  # the boundary: any exception of a renderer is its task's error
            line = f"{type(error).__name__}: {error}".splitlines()[0]
            reply = Reply(value=None, error=line, trace=traceback.format_exc(), seconds=time.perf_counter() - start)
        try:
            connection.send(replace(reply, computed=_processor_time() - before))
        except OSError:
            return
