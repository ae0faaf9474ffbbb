"""`Server`: a program that stays alive and answers requests in JSON lines, within limits.

Requests and answers are JSON objects, one per line, over standard input and output (docs/protocol.md, version 2). The
next request is sent after the answer to the last one. The memory, the number of processes and the output of the program
and its descendants together are limited. A program that dies, exceeds a limit or sends an unexpected answer is started
again for the next request.
"""

import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
import weakref
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import psutil

from rayproof.reports.processes.signals import adopt_orphans, descendants, end_below
from rayproof.reports.results.files import legible, several
from rayproof.reports.subjects import Subject, environment
from rayproof.reports.subjects.calls import (
    GLANCE,
    KEEPER,
    LONGEST_LINE,
    MOST_SAID,
    Ended,
    Overrun,
    how_it_ended,
    last_lines,
    size_below,
    withheld,
)

LARGEST_FILE = 2**32  # bytes of a file; the total output is measured and limited to much less
LONGEST_ANSWER = 2**20  # bytes of a line; longer lines are cut, so that they are no answers
MOST_PROCESSES = 256  # that a program may have at once
PARTING = 2.0  # s, waiting for a program that has closed its output to end
SCENES, MUCH = 100, 10**6  # over this number of scenes, a program may grow by this many bytes per scene
ANSWERS = {"ok": bool, "unsupported": str, "error": str, "capabilities": dict}


@dataclass(frozen=True, kw_only=True)
class ServingCost:
    """Starting times and growth of memory of a program that stays alive."""

    start: float  # s, for starts since the last report; 0 if the program was running
    last_start: float  # s, for the last start
    growth: float  # bytes of memory per scene, if the memory grows from scene to scene; otherwise 0


class Server:
    """A program under test, which is started by its first request, and the folder in which it works."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.folder = Path(tempfile.mkdtemp(prefix="rayproof-"))
        self._start = self._last_start = 0.0  # s, for starts since the last report, and for the last start
        self._running: _Running | None = None
        self._sizes: deque[int] = deque(maxlen=SCENES + 1)  # bytes of memory after each of the last scenes
        self._prints, self._first_print = 0, ""  # since the last report

    def ask(self, request: Mapping[str, Any], *, seconds: float, output: int) -> Ended:
        """Send a request and return its result, within `seconds`; `output` limits the size of the folder [bytes].

        If the program must be started, its capabilities are requested first, so that its start is not counted in the
        time of the request.
        """
        if self._running is None:
            begun = time.monotonic()
            self._running = _Running(self.subject, self.folder)
            self._sizes.clear()
            ended = self._asked({"capabilities": True}, seconds=self.subject.seconds, output=output)
            self._last_start = time.monotonic() - begun
            self._start += self._last_start
            if "capabilities" in request or ended.lost or self._running is None:
                return ended
        ended = self._asked(request, seconds=seconds, output=output)
        if self._running is not None and "scene" in request:
            self._sizes.append(self._running.memory())
        return ended

    def _asked(self, request: Mapping[str, Any], *, seconds: float, output: int) -> Ended:
        assert self._running is not None
        ended = self._running.ask(request, seconds=seconds, output=output)
        self._prints, self._first_print = self._prints + ended.prints, self._first_print or ended.first_print
        if ended.lost or ended.astray:
            self.stop()
        return ended

    def standing(self) -> ServingCost:
        """Return starting times and growth; the times of starts are returned only once."""
        start, self._start = self._start, 0.0
        return ServingCost(start=start, last_start=self._last_start, growth=self._growth())

    def notes(self) -> tuple[str, ...]:
        """Return a sentence on the lines that the program printed since the last report, if there are any."""
        count, first = self._prints, self._first_print
        self._prints, self._first_print = 0, ""
        return (
            f"It printed {several(count, 'line')} to standard output that are no answers, which are ignored: {first}",
        ) * (count > 0)

    def _growth(self) -> float:
        """Return the growth of memory per scene over the last `SCENES` scenes [bytes]; 0 if it is at most `MUCH`.

        Both halves must grow: data that is loaded once, or kept for a larger image, makes only one of them grow.
        """
        if len(self._sizes) <= SCENES:
            return 0.0
        first, middle, last = (self._sizes[place] for place in (0, SCENES // 2, SCENES))
        grown = 2 * min(middle - first, last - middle) / SCENES
        return (last - first) / SCENES if grown > MUCH else 0.0

    def stop(self) -> None:
        """End the program and its descendants."""
        if self._running is not None:
            self._running.end()
            self._running = None

    def close(self) -> None:
        """End the program and remove its folder."""
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)


class _Running:
    """A running program and its output since the start."""

    def __init__(self, subject: Subject, folder: Path) -> None:
        adopt_orphans()
        self._others = frozenset(process.pid for process in descendants(os.getpid()))
        self._subject, self._folder = subject, folder
        self._complaint: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  closed by `end`
        limits = [str(os.getpid()), str(subject.memory), str(LARGEST_FILE)]
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", KEEPER, *limits, *subject.command],
            cwd=folder,
            env=environment(subject.variables),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaint,
            start_new_session=True,
            bufsize=0,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._input, self._output = self._process.stdin, self._process.stdout
        os.set_blocking(self._output.fileno(), False)
        self._rest = b""  # output after the end of the last line
        self._number = -1  # of the last request
        self._written = 0  # bytes of standard output
        self._finalizer = weakref.finalize(
            self, _end, self._process, self._others, (self._input, self._output, self._complaint)
        )

    def ask(self, request: Mapping[str, Any], *, seconds: float, output: int) -> Ended:
        """Send a request, wait for its answer and return the result."""
        self._number += 1
        complained = os.fstat(self._complaint.fileno()).st_size
        lines: list[bytes] = []
        with contextlib.suppress(BrokenPipeError):  # it has ended, which `_watch` detects
            self._input.write(json.dumps({"id": self._number, **request}).encode() + b"\n")
        problem, answers = self._watch(lines, seconds, output)
        prints = [line for line in lines if _answer(line) is None]
        about: dict[str, Any] = {
            "said": b"\n".join(lines)[-MOST_SAID:].decode(errors="replace"),
            "complaint": self._complained(complained),
            "prints": len(prints),
            "first_print": legible(prints[0].decode(errors="replace").strip())[:LONGEST_LINE] if prints else "",
        }
        if answers:
            if (astray := self._astray(answers)) is not None:
                return Ended(problem=astray, refusal=None, astray=True, **about)
            problem = self._exceeded(output)
            if problem is None:
                return self._concluded(answers[0], **about)
        stopped, code = isinstance(problem, Overrun), self._process.returncode
        if self._rest.strip():
            half = legible(self._rest[:LONGEST_LINE].decode(errors="replace"))
            problem = f"{problem}; the last line of its output has no end: {half!r}"
        last, note = last_lines(about["complaint"]), withheld(self._subject.variables) if code else ""
        problem = f"{problem}: {last}{note}" if last else f"{problem}{note}"
        return Ended(problem=problem, refusal=None, stopped=stopped, code=code, lost=True, **about)

    def _watch(self, lines: list[bytes], seconds: float, output: int) -> tuple[str | None, list[dict[str, Any]]]:
        """Append lines to `lines` until one is an answer.

        Return the reason why there will be no answer, or None; and the answers, of which one is expected.
        """
        poll = select.poll()
        poll.register(self._output.fileno(), select.POLLIN | select.POLLHUP)
        looked = time.monotonic()
        deadline = looked + seconds
        while True:
            ended = self._process.poll() is not None
            new, closed = self._read()
            lines += new
            if answers := [answer for line in new if (answer := _answer(line)) is not None]:
                return None, answers
            if ended or closed:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(timeout=PARTING)
                code = self._process.returncode
                why = "it closed its standard output" if code is None else how_it_ended(code, LARGEST_FILE)
                return f"{why} without an answer", []
            now = time.monotonic()
            if now >= deadline:
                return Overrun(f"it did not answer within {seconds:g} s and was stopped"), []
            if now - looked >= GLANCE:
                looked = now
                if (problem := self._exceeded(output)) is not None:
                    return problem, []
            poll.poll(1000 * max(0.0, min(GLANCE, deadline - now)))

    def _read(self) -> tuple[list[bytes], bool]:
        """Return the complete lines of new output, and whether the output has been closed."""
        try:
            piece = self._output.read(2**16)
        except BlockingIOError:
            piece = None
        if piece is None:
            return [], False
        self._written += len(piece)
        *whole, self._rest = (self._rest + piece).split(b"\n")
        self._rest = self._rest[:LONGEST_ANSWER]
        return [line for line in whole if line.strip()], not piece

    def _astray(self, answers: list[dict[str, Any]]) -> str | None:
        """Return a sentence if the answer has a wrong number or a second answer follows, otherwise None."""
        number = answers[0]["id"]
        if type(number) is not int or number != self._number:
            again = " a second time" if type(number) is int and number == self._number - 1 else ""
            return f"request {self._number} was under way, and it answered {_short(number)}{again}"
        new, _ = self._read()
        if len(answers) > 1 or any(_answer(line) is not None for line in new):
            return f"it answered request {self._number} twice"
        return None

    def _concluded(self, answer: Mapping[str, Any], **about: Any) -> Ended:
        """Return the result in an answer; its `problem` names an invalid answer."""
        keys = [key for key in ANSWERS if key in answer]
        value = answer[keys[0]] if len(keys) == 1 else None
        if len(keys) != 1:
            problem = f"its answer must have one of {', '.join(ANSWERS)}, got {_short(answer)}"
        elif type(value) is not ANSWERS[keys[0]] or value is False:
            wanted = {bool: "true", str: "a text", dict: "an object"}[ANSWERS[keys[0]]]
            problem = f"`{keys[0]}` of its answer must be {wanted}, got {_short(value)}"
        elif keys[0] == "unsupported":
            refusal = legible(value).strip()[:LONGEST_LINE] or "It says that it cannot."
            return Ended(problem=None, refusal=refusal, **about)
        elif keys[0] == "error":
            reason = legible(value).strip()[:LONGEST_LINE] or "it does not say why"
            return Ended(problem=reason, refusal=None, reported=True, **about)
        else:
            return Ended(problem=None, refusal=None, declared=value if keys[0] == "capabilities" else None, **about)
        return Ended(problem=problem, refusal=None, **about)

    def _exceeded(self, output: int) -> str | None:
        """Return a sentence on a limit that the program and its descendants exceed together, or None."""
        written = size_below(self._folder) + self._written + os.fstat(self._complaint.fileno()).st_size
        if written > output:
            return f"it wrote more than {output / 2**20:g} MiB and was stopped"
        below = descendants(self._process.pid)
        if len(below) > MOST_PROCESSES:
            return f"it had more than {MOST_PROCESSES} processes and was stopped"
        if self.memory(below) > self._subject.memory:
            return f"it took more than {self._subject.memory / 2**30:g} GiB of memory and was stopped"
        return None

    def memory(self, below: list[psutil.Process] | None = None) -> int:
        """Return the resident memory of the program and its descendants [bytes]."""
        total = 0
        for process in descendants(self._process.pid) if below is None else below:
            with contextlib.suppress(psutil.Error):
                total += process.memory_info().rss
        return total

    def _complained(self, begin: int) -> str:
        """Return the end of standard error since the byte `begin`."""
        end = os.fstat(self._complaint.fileno()).st_size
        begin = max(begin, end - MOST_SAID)
        return os.pread(self._complaint.fileno(), end - begin, begin).decode(errors="replace")

    def end(self) -> None:
        """End the program and its descendants."""
        self._finalizer()


def _end(process: subprocess.Popen[bytes], others: frozenset[int], files: tuple[IO[bytes], ...]) -> None:
    if process.poll() is None:
        end_below(process.pid)
        process.kill()
        process.wait()
    end_below(os.getpid(), besides=others)
    for file in files:
        with contextlib.suppress(OSError):
            file.close()


def _answer(line: bytes) -> dict[str, Any] | None:
    """Return a line as a JSON object with an `id`, or None if it is none."""
    if not line.lstrip().startswith(b"{"):
        return None
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return answer if isinstance(answer, dict) and "id" in answer else None


def _short(value: object) -> str:
    """Return a value as short, legible JSON for a sentence."""
    return legible(json.dumps(value))[:80]
