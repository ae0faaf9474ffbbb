"""`Subject`, the renderer under test; and how a user's program is chosen, called, confined and served.

The tracer is put to the test by its configurations. Every other subject is one candidate under its own name, judged by
the references that share no code with it; what it declares that it cannot do is `unsupported`. Of this user's
environment a program gets some variables and, when it is confined, some folders.
"""

import fnmatch
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from rayproof.reports.subjects.protocol import Capabilities

if TYPE_CHECKING:
    from rayproof.reports.subjects.isolate import Order

ISOLATE = str(Path(__file__).with_name("isolate.py"))
# What a program needs to start, to find its libraries and devices, and to write numbers as everybody does.
KEPT = (
    "PATH", "HOME", "TMPDIR", "LANG", "LC_*", "LD_*", "PYTHON*", "VIRTUAL_ENV", "CONDA_*", "CUDA_*", "*_THREADS",
    "SYSTEMROOT", "TEMP", "TMP", "DYLD_*",
)  # fmt: skip
# Where other programs of the user keep files, sockets and secrets.
HIDDEN = ("/root", "/home", "/tmp", "/var/tmp", "/run", "/dev/shm", "/mnt", "/media")
MOST_HOPS = 16  # of links
WAITING = 10.0  # times its limit of processor time: how long an enclosed program may take by the clock
CALL = "/tmp/call"  # where an enclosed program finds its scene, as isolate.py has it


@dataclass(frozen=True, kw_only=True)
class Enclosure:
    """All that a stranger's program finds, and what it and all that it starts may take together."""

    submission: str  # its folder, which it finds read-only as /submission
    allowed: tuple[str, ...]  # folders and files that it may read at their own places
    masked: tuple[str, ...]  # folders below those that it finds empty
    environment: tuple[tuple[str, str], ...]  # names and values; nothing else of the environment is passed
    processes: int  # and threads
    memory: int  # bytes
    disk: int  # bytes of its scratch folder
    seconds: float  # of processor time
    products: str | None = None  # of a build, which may change /submission: the folder that it is written to
    turns: str  # a file whose locks let a call be made again while no other one runs
    confined: bool = True  # False: this platform cannot, and the teacher allowed it

    @property
    def longest(self) -> float:
        """Return after how long [s] by the clock a program that waits is ended."""
        return WAITING * self.seconds

    @contextmanager
    def turn(self, *, alone: bool) -> Iterator[None]:
        """Hold other calls off: all of them, or those that want to be alone."""
        import fcntl

        with Path(self.turns).open("a") as file:
            fcntl.flock(file, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
            yield

    def wrapped(self, arguments: Sequence[str], folder: Path) -> list[str]:
        """Return the command that runs a program in here; its words name what it finds."""
        if not self.confined:
            return ["/bin/sh", "-c", 'cd "$0" && exec "$@"', self.products or self.submission, *arguments]
        order: Order = {
            "folder": str(folder.resolve()),
            "hidden": [],
            "shown": [],
            "secret": [],
            "enclosure": {
                "allowed": list(self.allowed),
                "masked": list(self.masked),
                "submission": self.submission,
                "products": self.products,
                "processes": self.processes,
                "memory": self.memory,
                "disk": self.disk,
                "seconds": self.seconds,
            },
        }
        words = [word.replace(str(folder), CALL) for word in arguments]
        return [sys.executable, "-I", "-S", ISOLATE, json.dumps(order), *words]


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What a program gets beyond the usual: more variables by name; whether it is confined, or wholly enclosed."""

    variables: tuple[str, ...] = ()
    confined: bool = False
    enclosure: Enclosure | None = None

    def environment(self) -> dict[str, str]:
        """Return the variables that a program gets, and their values."""
        if self.enclosure is not None:
            return dict(self.enclosure.environment)
        return {
            name: value
            for name, value in os.environ.items()
            if name in self.variables or any(fnmatch.fnmatchcase(name, pattern) for pattern in KEPT)
        }

    @property
    def withheld(self) -> int:
        """Return how many variables a program does not get that --env would pass on."""
        return 0 if self.enclosure is not None else len(os.environ) - len(self.environment())

    def wrapped(self, arguments: Sequence[str], folder: Path) -> list[str]:
        """Return the command that runs a program in its folder, shut off if it is confined."""
        if self.enclosure is not None:
            return self.enclosure.wrapped(arguments, folder)
        if not self.confined:
            return list(arguments)
        order: Order = {
            "folder": str(folder.resolve()),
            "hidden": _hidden(),
            "shown": _shown(arguments),
            "secret": _secret(),
            "enclosure": None,
        }
        return [sys.executable, "-I", "-S", ISOLATE, json.dumps(order), *arguments]


def reason_unconfined(surroundings: Surroundings | None = None) -> str | None:
    """Return why this platform cannot confine a program, in these surroundings if given, in a sentence, or None."""
    if sys.platform != "linux":
        return f"programs are confined by Linux's namespaces, which {sys.platform} lacks"
    with tempfile.TemporaryDirectory(prefix="rayproof-") as folder:
        enclosed = surroundings is not None and surroundings.enclosure is not None
        command = ["/bin/true"] if enclosed else [sys.executable, "-I", "-S", "-c", ""]
        trial = (surroundings or Surroundings(confined=True)).wrapped(command, Path(folder))
        ended = subprocess.run(trial, capture_output=True, text=True, timeout=60, check=False)
    return None if ended.returncode == 0 else ended.stderr.strip() or f"exit code {ended.returncode}"


def _hidden() -> list[str]:
    return [*HIDDEN, str(Path.home()), tempfile.gettempdir()]


def _secret() -> list[str]:
    """Return the folder with rayproof's cache."""
    return [str(Path(os.environ.get("RAYPROOF_CACHE") or platformdirs.user_cache_dir("rayproof")).absolute())]


def _shown(arguments: Sequence[str]) -> list[str]:
    """Return what of the hidden folders a program cannot do without: itself, the files that it names, their folders."""
    closed = [Path(path).resolve() for path in (*_hidden(), *_secret())]
    shown: dict[str, None] = {}
    for path in (Path(sys.prefix), Path(sys.base_prefix), *filter(_lies, map(Path, arguments))):
        for at in _hops(path.absolute()):
            # With what is installed beside `bin`; never a folder that all the rest lies in, too.
            around = [at] if at.is_dir() else [at.parent.parent, at.parent, at][at.parent.name != "bin" :]
            nearest = next((near for near in around if near.is_file() or _apart(near.resolve(), closed)), None)
            if nearest is not None:
                shown[str(nearest)] = None
    return list(shown)


def _hops(path: Path) -> list[Path]:
    """Return a path, what it links to and so on, and where all that really lies."""
    hops = [path]
    while hops[-1].is_symlink() and len(hops) < MOST_HOPS:
        hops.append(hops[-1].parent / hops[-1].readlink())
    return [*hops, path.resolve()]


def _lies(path: Path) -> bool:
    try:
        return path.is_absolute() and path.exists()
    except (OSError, ValueError):
        return False


def _apart(path: Path, closed: Sequence[Path]) -> bool:
    """Say whether a folder neither is nor holds one of those that stay closed."""
    return not any(place.is_relative_to(path) for place in closed)


TRACER = "tracer"
# The names of a stranger's program in checks, images and the report: one that is called for each image, one that stays
# alive, and a Python function, which is called by a program of ours that stays alive.
PROGRAM, SERVED, FUNCTION = "exec", "serve", "python"


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The renderer under test, as plain data that travels between processes."""

    name: str  # TRACER, a reference's name, PROGRAM, SERVED or FUNCTION
    title: str  # what the user wrote
    command: tuple[str, ...] = ()  # of a program: its arguments; {scene} and {output} are filled in for each call
    capabilities: Capabilities = field(default_factory=Capabilities)
    identity: tuple[str, ...] = ()  # what a result of it depends on: a finished case of another one is not taken up
    seconds: float = 120.0  # of a program: how long one call may take
    memory: int = 8 * 2**30  # bytes of address space that a program may have
    surroundings: Surroundings = field(default_factory=Surroundings)  # of a program

    @property
    def is_tracer(self) -> bool:
        """Say whether the tracer's configurations are under test."""
        return self.name == TRACER

    @property
    def is_program(self) -> bool:
        """Say whether a user's program or function is under test."""
        return self.name == PROGRAM or self.stays

    @property
    def stays(self) -> bool:
        """Say whether it is a program that is started once and answers one scene after another."""
        return self.name in (SERVED, FUNCTION)

    @property
    def averages(self) -> bool:
        """Say whether a program averages over the points of a pixel itself."""
        return self.capabilities.samples or any("{samples}" in word for word in self.command)

    @property
    def image_name(self) -> str:
        """Return the name of the file that a program writes."""
        pfm = self.capabilities.format == "pfm" or any("{output.pfm}" in word for word in self.command)
        return "image.pfm" if pfm else "image.exr"

    def renderer(self, configuration: str) -> str:
        """Return the name under which a candidate's images are filed."""
        return f"{TRACER}-{configuration}" if self.is_tracer else configuration


THE_TRACER = Subject(name=TRACER, title=TRACER)
