"""Other people's parsers in a process of their own, within limits of memory and processor time.

A parser in C may crash on a hostile file, and one in any language may ask for all memory or never end. So it runs in a
child that is kept for the next file, answers in plain bytes, and ends with whoever started it: its standard input
closes then. Content and answers are unnamed files that both have open, so that no folder is ever left behind.

A parser is a module with `answer(kind, content) -> (facts, bytes)`; facts are small and go through JSON, and a
ValueError says what is wrong with the content.
"""

import atexit
import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from rayproof import HOLDER

START = "import sys; sys.path.insert(0, sys.argv[1]); from rayproof.cases.foreign import serve; serve(*sys.argv[2:])"
PATIENCE = 60.0  # s of wall clock beyond the processor time granted: the machine may be busy, a process stopped
LONGEST = 64 * 2**10  # bytes of facts
KEPT = 32 * 2**20  # bytes of content after which the child is not kept, and gives its memory back


class ForeignError(Exception):
    """A parser's word that a file cannot be read, or how it ended; one sentence without a subject."""


class _Child:
    """A running parser."""

    def __init__(self, module: str) -> None:
        self.owner = os.getpid()
        self.content = tempfile.TemporaryFile()  # noqa: SIM115  both are closed by `end`
        self.answer = tempfile.TemporaryFile()  # noqa: SIM115
        files = (self.content.fileno(), self.answer.fileno())
        self.process = subprocess.Popen(
            [sys.executable, "-I", "-c", START, str(HOLDER), module, *map(str, files)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            pass_fds=files,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )

    def ask(self, kind: str, content: bytes, *, seconds: float, memory: int, most: int) -> tuple[dict[str, Any], bytes]:
        """Return the parser's answer, of which `problem` says that it refuses; raise ForeignError if it ended."""
        assert self.process.stdin is not None
        self.content.seek(0)
        self.content.truncate()
        self.content.write(content)
        self.content.flush()
        order = {"kind": kind, "seconds": seconds, "memory": memory, "most": most}
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps(order).encode() + b"\n")
            self.process.stdin.flush()
        facts = json.loads(self._line(time.monotonic() + seconds + PATIENCE, seconds, memory))
        self.answer.seek(0)
        return facts, b"" if "problem" in facts else self.answer.read(most)

    def _line(self, deadline: float, seconds: float, memory: int) -> bytes:
        """Return the line of facts; raise ForeignError if the child ends or does not answer before the deadline."""
        assert self.process.stdout is not None
        line = b""
        while not line.endswith(b"\n") and len(line) < LONGEST:
            ready, _, _ = select.select([self.process.stdout], [], [], max(0.0, deadline - time.monotonic()))
            piece = os.read(self.process.stdout.fileno(), LONGEST) if ready else b""
            if not piece:
                ended = self.end(wait=1.0 if ready else 0.0)
                raise ForeignError(_ending(ended, seconds, memory))
            line += piece
        return line

    def end(self, *, wait: float = 0.0) -> int:
        """End the child and return the exit code that it had, if any, before it was ended."""
        for file in (self.process.stdin, self.content, self.answer):
            with contextlib.suppress(OSError):
                if file is not None:
                    file.close()
        try:
            code = self.process.wait(timeout=wait)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()
        return code


_children: dict[str, _Child] = {}


def ask(
    module: str, kind: str, content: bytes, *, seconds: float, memory: int, most: int
) -> tuple[dict[str, Any], bytes]:
    """Return what the parser `module` makes of `content`: its facts and its bytes, at most `most`.

    `seconds` of processor time and `memory` bytes beside what the parser's own code takes are its limits.

    Raises:
        ForeignError: it refuses the content, came to a limit, or crashed.

    """
    child = _children.pop(module, None)
    if child is not None and (child.owner != os.getpid() or child.process.poll() is not None):
        # Another process's after a fork, or ended by somebody since.
        if child.owner == os.getpid():
            child.end()
        child = None
    child = child or _Child(module)
    try:
        answer = child.ask(kind, content, seconds=seconds, memory=memory, most=most)
    except BaseException:
        child.end()
        raise
    facts, found = answer
    if len(content) + len(found) > KEPT or facts.get("large"):
        child.end()
    else:
        _children[module] = child
    if "problem" in facts:
        raise ForeignError(facts["problem"])
    return facts, found


@atexit.register
def end_all() -> None:
    """End the parsers of this process."""
    while _children:
        _, child = _children.popitem()
        if child.owner == os.getpid():
            child.end()


def _ending(code: int, seconds: float, memory: int) -> str:
    if code == -getattr(signal, "SIGXCPU", 0):
        return f"takes more than {seconds:g} s of processor time to parse"
    if code == -getattr(signal, "SIGKILL", 0):
        return f"takes more than {seconds + PATIENCE:g} s, or more memory than there is, to parse"
    if code < 0:
        return (
            f"takes more than {memory / 2**20:.0f} MiB to parse, or crashes its parser ({signal.Signals(-code).name})"
        )
    return f"takes more than {memory / 2**20:.0f} MiB to parse (its parser ended with exit code {code})"


def serve(module: str, content: str, answer: str) -> None:
    """Answer until standard input ends; the parser's side, in a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for who asked
    parse: Callable[[str, bytes], tuple[dict[str, Any], bytes]] = import_module(module).answer
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a parser prints is no answer
    with os.fdopen(int(content), "rb") as question, os.fdopen(int(answer), "wb") as result:
        for line in sys.stdin.buffer:
            order = json.loads(line)
            _limit(order["seconds"], order["memory"], order["most"])
            replies.write(json.dumps(_answered(parse, order, question, result)).encode() + b"\n")
            replies.flush()


def _answered(parse: Callable[..., Any], order: dict[str, Any], question: IO[bytes], result: IO[bytes]) -> Any:
    try:
        question.seek(0)
        facts, content = parse(order["kind"], question.read())
        if len(content) > order["most"]:
            return {"problem": f"unfolds to {len(content)} bytes, more than {order['most']}"}
        result.seek(0)
        result.truncate()
        result.write(content)
        result.flush()
    except MemoryError:
        return {"problem": f"takes more than {order['memory'] / 2**20:.0f} MiB to parse", "large": True}
    except Exception as error:
        return {"problem": (" ".join(str(error).split()) or type(error).__name__)[:1000]}
    return facts


def _limit(seconds: float, memory: int, most: int) -> None:
    """Limit this process by what it has used so far and what it is granted; nothing where the platform cannot."""
    if os.name != "posix":
        return
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    limits = {
        resource.RLIMIT_CPU: int(used.ru_utime + used.ru_stime + seconds) + 1,
        resource.RLIMIT_FSIZE: most + 2**20,
        resource.RLIMIT_CORE: 0,
    }
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limits[resource.RLIMIT_AS] = pages * os.sysconf("SC_PAGE_SIZE") + memory
    for kind, limit in limits.items():
        _, hard = resource.getrlimit(kind)
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
