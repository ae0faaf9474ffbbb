"""`Subject`, the renderer under test; selection of a user's program, calls within limits, and serving.

The tracer is tested in several configurations. Every other subject is tested once under its own name, and judged by the
references that share no code with it; a scene that it declares it cannot render is `unsupported`. A program gets only
some of the user's environment variables.
"""

import fnmatch
import os
from collections.abc import Collection
from dataclasses import dataclass, field

from rayproof.reports.subjects.image_files import FORMATS
from rayproof.reports.subjects.protocol import Capabilities

# Variables that a program needs to start, to find its libraries and devices, and to write numbers in the usual format.
KEPT = (
    "PATH", "HOME", "TMPDIR", "LANG", "LC_*", "LD_*", "PYTHON*", "VIRTUAL_ENV", "CONDA_*", "CUDA_*", "*_THREADS",
    "SYSTEMROOT", "TEMP", "TMP", "DYLD_*",
)  # fmt: skip


def environment(variables: Collection[str] = ()) -> dict[str, str]:
    """Return the environment of a program under test: the variables in `KEPT` and in `variables`."""
    return {
        name: value
        for name, value in os.environ.items()
        if name in variables or any(fnmatch.fnmatchcase(name, pattern) for pattern in KEPT)
    }


TRACER = "tracer"
# The transports of a user's program: it is called for each image, it stays alive, or it is a Python function.
PROGRAM, SERVED, FUNCTION = "exec", "serve", "python"


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The renderer under test, as plain data that can be sent between processes."""

    name: str  # TRACER, the name of a reference, or of a program: its declared name, otherwise the name of its file
    title: str  # the user's words for it, such as `exec:./program {scene} {output}`
    transport: str | None = None  # of a program: PROGRAM, SERVED or FUNCTION
    command: tuple[str, ...] = ()  # of a program: its arguments; {scene} and {output} are filled in for each call
    capabilities: Capabilities = field(default_factory=Capabilities)
    identity: tuple[str, ...] = ()  # determines its results: finished cases are resumed only if it is the same
    seconds: float = 120.0  # of a program: time limit of a call
    memory: int = 8 * 2**30  # of a program: limit of its address space [bytes]
    variables: tuple[str, ...] = ()  # of a program: names of environment variables that it gets besides the usual ones
    declare: str = ""  # of a program: path of a file with capabilities that it does not declare itself

    @property
    def options(self) -> list[str]:
        """Return the options of a command that tests the same subject."""
        words = [] if self.is_tracer else ["--subject", self.title]
        words += ["--declare", self.declare] if self.declare else []
        return words + [word for name in self.variables for word in ("--env", name)]

    @property
    def is_tracer(self) -> bool:
        """Return whether the tracer is under test."""
        return self.name == TRACER

    @property
    def is_program(self) -> bool:
        """Return whether a user's program or function is under test."""
        return self.transport is not None

    @property
    def stays(self) -> bool:
        """Return whether the subject is a program that is started once and renders one scene after another."""
        return self.transport in (SERVED, FUNCTION)

    @property
    def varies(self) -> bool:
        """Return whether two images of the same scene may differ within the limits."""
        return self.is_program and not self.capabilities.deterministic

    @property
    def averages(self) -> bool:
        """Return whether a program averages over the sample points of a pixel itself."""
        return self.capabilities.samples or any("{samples}" in word for word in self.command)

    @property
    def image_name(self) -> str:
        """Return the name of the file that a program writes."""
        if self.capabilities.writes:
            return self.capabilities.writes
        words = [word for word in FORMATS if any(f"{{output.{word}}}" in part for part in self.command)]
        return f"image.{words[0] if words else self.capabilities.format}"

    def renderer(self, configuration: str) -> str:
        """Return the name under which the images of a configuration are stored."""
        return f"{TRACER}-{configuration}" if self.is_tracer else configuration


THE_TRACER = Subject(name=TRACER, title=TRACER)
