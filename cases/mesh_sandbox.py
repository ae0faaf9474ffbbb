"""Mesh parsers in a child process with limits of memory and time, and the budget of reading one scene.

A parser in C may crash on a hostile file, and one in any language may ask for all memory or never end. So it runs in a
child with limits of memory and processor time, which is kept for the next file, answers in plain bytes, and ends with
the process that started it: its standard input closes then. Content and answers are unnamed files that both have open,
so that no folder is ever left behind.

A file of a kilobyte can ask for gigabytes: by instances of instances, by parameters made of parameters, by arrays
without data. So every reader spends from one budget per scene before it builds anything, and the scene may become
larger only with the bytes that are really there.

A parser is named "module:function"; the function imports what it needs and returns `answer(kind, content) -> (facts,
bytes)`. Facts are small and go through JSON, and a ValueError says what is wrong with the content.
"""

import atexit
import contextlib
import io
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from rayproof import HOLDER
from rayproof.cases.scene import SceneError

START = (
    "import sys; sys.path.insert(0, sys.argv[1]); from rayproof.cases.mesh_sandbox import serve; serve(*sys.argv[2:])"
)
PATIENCE = 60.0  # s of wall clock beyond the processor time granted: the machine may be busy, a process stopped
LONGEST = 64 * 2**10  # bytes of facts
KEPT = 32 * 2**20  # bytes of content after which the child is not kept, and gives its memory back

FREE_BYTES = 64 * 2**20  # that any scene may take once its arrays are unfolded, however small its files are
BYTES_A_BYTE = 16  # more for each byte read: a face of a text mesh has 8 characters and takes 24 bytes
LIMITS = {
    "triangles": 20_000_000,
    "elements": 100_000,  # of a file's tree: XML elements, glTF nodes and primitives
    "references": 1_000_000,  # from element to element, followed again for every instance
    "shapes": 20_000,  # after instances are unfolded
    "includes": 256,  # of XML files in each other
    "levels of nesting": 64,
}


@dataclass(kw_only=True)
class Budget:
    """One scene's budget. What runs out is refused in a sentence that names who asked, what ran out and the limit."""

    read: int = 0  # bytes of files, each once
    meshes: dict[Path, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # that were read, by file
    notes: dict[Path, tuple[str, ...]] = field(default_factory=dict)  # what to report of these
    _files: set[Path] = field(default_factory=set)
    _spent: dict[str, int] = field(default_factory=dict)

    def spend(self, what: str, amount: int, *, by: str) -> None:
        """Take `amount` of one of LIMITS for `by`.

        Raises:
            SceneError: there is not so much left.

        """
        self._spent[what] = self._spent.get(what, 0) + amount
        if self._spent[what] > LIMITS[what]:
            raise SceneError(
                f"{by} takes the scene to {self._spent[what]} {what}; at most {LIMITS[what]} {what} are read"
            )

    def expand(self, size: int, *, by: str) -> None:
        """Take `size` bytes of memory for arrays or texts that `by` unfolds to.

        Raises:
            SceneError: the files that were read are too small to need so much.

        """
        self._spent["bytes"] = self._spent.get("bytes", 0) + size
        most = FREE_BYTES + BYTES_A_BYTE * self.read
        if self._spent["bytes"] > most:
            raise SceneError(
                f"{by} takes the scene to {self._spent['bytes']} bytes; files of {self.read} bytes may unfold to at "
                f"most {most} bytes"
            )

    def go_down(self, depth: int, *, by: str) -> None:
        """Raise SceneError if `by` lies too many levels deep."""
        most = LIMITS["levels of nesting"]
        if depth > most:
            raise SceneError(f"{by} lies {depth} levels deep; at most {most} levels of nesting are read")

    def count_file(self, path: Path, size: int) -> None:
        """Count the bytes of a file that is read, the first time."""
        if path not in self._files:
            self._files.add(path)
            self.read += size


Parser = Callable[[str, bytes], tuple[dict[str, Any], bytes]]


class ForeignError(Exception):
    """A parser's word that a file cannot be read, or how it ended; one sentence without a subject."""


class _Child:
    """A running parser."""

    def __init__(self, parser: str) -> None:
        self.owner = os.getpid()
        self.content = tempfile.TemporaryFile()  # noqa: SIM115  both are closed by `end`
        self.answer = tempfile.TemporaryFile()  # noqa: SIM115
        files = (self.content.fileno(), self.answer.fileno())
        self.process = subprocess.Popen(
            [sys.executable, "-I", "-c", START, str(HOLDER), parser, *map(str, files)],
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
    parser: str, kind: str, content: bytes, *, seconds: float, memory: int, most: int
) -> tuple[dict[str, Any], bytes]:
    """Return what the parser `parser` makes of `content`: its facts and its bytes, at most `most`.

    `seconds` of processor time and `memory` bytes beside what the parser's own code takes are its limits.

    Raises:
        ForeignError: it refuses the content, came to a limit, or crashed.

    """
    child = _children.pop(parser, None)
    if child is not None and (child.owner != os.getpid() or child.process.poll() is not None):
        # Another process's after a fork, or ended by somebody since.
        if child.owner == os.getpid():
            child.end()
        child = None
    child = child or _Child(parser)
    try:
        answer = child.ask(kind, content, seconds=seconds, memory=memory, most=most)
    except BaseException:
        child.end()
        raise
    facts, arrays = answer
    if len(content) + len(arrays) > KEPT or facts.get("large"):
        child.end()
    else:
        _children[parser] = child
    if "problem" in facts:
        raise ForeignError(facts["problem"])
    return facts, arrays


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


def serve(parser: str, content: str, answer: str) -> None:
    """Answer until standard input ends; the parser's side, in a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for who asked
    module, _, function = parser.partition(":")
    parse: Parser = getattr(import_module(module), function)()
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a parser prints is no answer
    with os.fdopen(int(content), "rb") as question, os.fdopen(int(answer), "wb") as result:
        for line in sys.stdin.buffer:
            order = json.loads(line)
            _limit(order["seconds"], order["memory"], order["most"])
            replies.write(json.dumps(_answered(parse, order, question, result)).encode() + b"\n")
            replies.flush()


def _answered(parse: Parser, order: dict[str, Any], question: IO[bytes], result: IO[bytes]) -> Any:
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


def mesh_parser() -> Parser:
    """Return the parser of OBJ and PLY files (ours) and of STL and GLB files (trimesh)."""
    import trimesh  # before the limits are set: they are for the files

    from rayproof.cases.polygon_files import mesh_of

    def answer(kind: str, content: bytes) -> tuple[dict[str, Any], bytes]:
        """Return the numbers of vertices and triangles and what to report, and both: float64 and int64, three each.

        Raises:
            ValueError: it holds none, or more triangles than are read.

        """
        if kind in ("obj", "ply"):
            vertices, faces, notes = mesh_of(kind, content)
            if len(faces) > LIMITS["triangles"]:
                return {"triangles": len(faces)}, b""
            facts = {"triangles": len(faces), "vertices": len(vertices), "notes": notes}
            return facts, vertices.tobytes() + faces.tobytes()
        # From bytes and without a resolver: nothing that the file refers to can be opened.
        world = trimesh.load_scene(
            io.BytesIO(content), file_type=kind, process=False, maintain_order=True, skip_materials=True
        )
        triangles = sum(
            len(getattr(world.geometry[world.graph[node][1]], "faces", ())) for node in world.graph.nodes_geometry
        )
        if not 0 < triangles <= LIMITS["triangles"]:
            return {"triangles": triangles}, b""
        mesh = world.to_mesh()
        vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError(f"its vertices and faces are no triples, got {vertices.shape} and {faces.shape}")
        return {"triangles": len(faces), "vertices": len(vertices)}, vertices.tobytes() + faces.tobytes()

    return answer
