"""Who is under test: the tracer, any reference of the panel, or a stranger's program behind a command line.

The tracer is put to the test by its configurations. Every other subject is one candidate under its own name, judged by
the references that share no code with it; what it says it cannot do is `unsupported`.
"""

from dataclasses import dataclass, field

from rayproof.reports.subjects.capabilities import Capabilities
from rayproof.reports.subjects.surroundings import Surroundings

TRACER = "tracer"
PROGRAM = "exec"  # the name of a stranger's program in checks, images and the report


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The renderer under test, as plain data that travels between processes."""

    name: str  # TRACER, a reference's name or PROGRAM
    title: str  # what the user wrote
    command: tuple[str, ...] = ()  # of a program: its arguments, with {scene} and {output} still in them
    capabilities: Capabilities = field(default_factory=Capabilities)
    identity: tuple[str, ...] = ()  # what a result of it depends on: a finished case of another one is not taken up
    seconds: float = 120.0  # of a program: how long one call may take
    memory: int = 8 * 2**30  # bytes of address space that a program may have
    surroundings: Surroundings = field(default_factory=Surroundings)  # of a program

    @property
    def is_tracer(self) -> bool:
        """Say whether the tracer's configurations are under test."""
        return self.name == TRACER

    def renderer(self, configuration: str) -> str:
        """Return the name under which a candidate's images are filed."""
        return f"{TRACER}-{configuration}" if self.is_tracer else configuration


THE_TRACER = Subject(name=TRACER, title=TRACER)
