"""What starts the commands below `tests`: each is one function, and ends as a command of rayproof does."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest
from cyclopts import App

from rayproof.reports.cli import main


def program(command: Callable[..., int]) -> App:
    """Return the parser of a command's arguments."""
    spec = sys.modules[command.__module__].__spec__  # the module of a program that was started is called __main__
    name = spec.name if spec else command.__module__
    parser = App(
        name=f"python -m {name.removesuffix('.__main__')}", help_format="plaintext", suppress_keyboard_interrupt=False
    )
    parser.default(command)
    return parser


def call(command: Callable[..., int], arguments: Sequence[str] | None = None) -> int:
    """Run `command` with the process's arguments or these, and return the exit code."""
    return main(arguments, program(command))


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
