"""By which words this program was called, for hints that work where they are read."""

import os
import shlex
import shutil
import sys
from pathlib import Path

VARIABLE = "RAYPROOF_CALLED"  # set by the launcher of a checkout, and by `remember` for the processes of a run
NAME = "rayproof"


def called() -> str:
    """Return what to write before a command's arguments: ./rayproof in a checkout, or rayproof, for a shell."""
    return shlex.quote(os.environ.get(VARIABLE) or NAME)


def remember() -> None:
    """Let hints name the program by its path where it was called so and is on nobody's PATH."""
    program = sys.argv[0] if sys.argv else ""
    if VARIABLE not in os.environ and Path(program).name == NAME and shutil.which(NAME) is None:
        os.environ[VARIABLE] = program
