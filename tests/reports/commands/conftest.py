"""What the tests of the commands share: run one in this process and read what it printed."""

from collections.abc import Callable

import pytest

from rayproof.reports.cli import main
from tests.command_line import Ended

Rayproof = Callable[..., Ended]


@pytest.fixture
def rayproof(capsys: pytest.CaptureFixture[str]) -> Rayproof:
    """Run a command and return its exit code and what it printed."""

    def run(*arguments: object) -> Ended:
        code = main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Ended(code=code, out=printed.out, error=printed.err)

    return run
