"""`Subject`, the renderer under test; and how a user's program is chosen, called, limited and served.

The tracer is put to the test by its configurations. Every other subject is one candidate under its own name, judged by
the references that share no code with it; what it declares that it cannot do is `unsupported`. A program gets some
variables of this user's environment.
"""

import fnmatch
import os
from collections.abc import Collection
from dataclasses import dataclass, field

from rayproof.reports.subjects.image_files import FORMATS
from rayproof.reports.subjects.protocol import Capabilities

# What a program needs to start, to find its libraries and devices, and to write numbers as everybody does.
KEPT = (
    "PATH", "HOME", "TMPDIR", "LANG", "LC_*", "LD_*", "PYTHON*", "VIRTUAL_ENV", "CONDA_*", "CUDA_*", "*_THREADS",
    "SYSTEMROOT", "TEMP", "TMP", "DYLD_*",
)  # fmt: skip


def environment(variables: Collection[str] = ()) -> dict[str, str]:
    """Return the environment of a program under test: the usual variables, and those named in `variables`."""
    return {
        name: value
        for name, value in os.environ.items()
        if name in variables or any(fnmatch.fnmatchcase(name, pattern) for pattern in KEPT)
    }


TRACER = "tracer"
# How a user's program is asked: it is called for each image, it stays alive, or it is a Python function.
PROGRAM, SERVED, FUNCTION = "exec", "serve", "python"


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The renderer under test, as plain data that travels between processes."""

    name: str  # TRACER, a reference's name, or that of a program: what it declares, or else its file's
    title: str  # what the user wrote
    transport: str | None = None  # of a program: PROGRAM, SERVED or FUNCTION
    command: tuple[str, ...] = ()  # of a program: its arguments; {scene} and {output} are filled in for each call
    capabilities: Capabilities = field(default_factory=Capabilities)
    identity: tuple[str, ...] = ()  # what a result of it depends on: a finished case of another one is not taken up
    seconds: float = 120.0  # of a program: how long one call may take
    memory: int = 8 * 2**30  # bytes of address space that a program may have
    variables: tuple[str, ...] = ()  # of the environment, by name, that a program gets beyond the usual ones
    declare: str = ""  # the path of the file that says of a program what it does not say itself

    @property
    def options(self) -> list[str]:
        """Return the options of a command that puts the same subject under test."""
        words = [] if self.is_tracer else ["--subject", self.title]
        words += ["--declare", self.declare] if self.declare else []
        return words + [word for name in self.variables for word in ("--env", name)]

    @property
    def is_tracer(self) -> bool:
        """Say whether the tracer's configurations are under test."""
        return self.name == TRACER

    @property
    def is_program(self) -> bool:
        """Say whether a user's program or function is under test."""
        return self.transport is not None

    @property
    def stays(self) -> bool:
        """Say whether it is a program that is started once and answers one scene after another."""
        return self.transport in (SERVED, FUNCTION)

    @property
    def varies(self) -> bool:
        """Return whether two of its images of one scene may differ within the limits."""
        return self.is_program and not self.capabilities.deterministic

    @property
    def averages(self) -> bool:
        """Say whether a program averages over the points of a pixel itself."""
        return self.capabilities.samples or any("{samples}" in word for word in self.command)

    @property
    def image_name(self) -> str:
        """Return the name of the file that a program writes."""
        if self.capabilities.writes:
            return self.capabilities.writes
        words = [word for word in FORMATS if any(f"{{output.{word}}}" in part for part in self.command)]
        return f"image.{words[0] if words else self.capabilities.format}"

    def renderer(self, configuration: str) -> str:
        """Return the name under which a candidate's images are filed."""
        return f"{TRACER}-{configuration}" if self.is_tracer else configuration


THE_TRACER = Subject(name=TRACER, title=TRACER)
