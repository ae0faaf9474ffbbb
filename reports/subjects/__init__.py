"""`Subject`, the renderer under test; and how a user's program is chosen, called, limited and served.

The tracer is put to the test by its configurations. Every other subject is one candidate under its own name, judged by
the references that share no code with it; what it declares that it cannot do is `unsupported`. A program gets some
variables of this user's environment.
"""

import fnmatch
import os
from collections.abc import Collection
from dataclasses import dataclass, field

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
    variables: tuple[str, ...] = ()  # of the environment, by name, that a program gets beyond the usual ones

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
