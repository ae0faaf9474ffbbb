"""What starts the commands below `tests`: each is one function, and ends as a command of rayproof does."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest
from cyclopts import App

from rayproof.reports.cli import main


def call(command: Callable[..., int], arguments: Sequence[str] | None = None) -> int:
    """Run `command` with the process's arguments or these, and return the exit code."""
    program = App(name=f"python -m {command.__module__}", help_format="plaintext", suppress_keyboard_interrupt=False)
    program.default(command)
    return main(arguments, program)


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a command ended."""

    code: int
    out: str
    error: str


Command = Callable[..., Ended]


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Return a function that runs a command in this process with arguments."""

    def run(of: Callable[..., int], *arguments: object) -> Ended:
        code = call(of, [str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Ended(code=code, out=printed.out, error=printed.err)

    return run
