"""The program name and arguments of this call of rayproof, for hints that can be pasted into a shell."""

import os
import shlex
import shutil
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from rayproof import ROOT

VARIABLE = "RAYPROOF_CALLED"  # set by the launcher of a checkout, and by `remember` for the child processes of a run
NAME = "rayproof"


def called() -> str:
    """Return the program's name, quoted for a shell: ./rayproof in a checkout, otherwise rayproof."""
    return shlex.quote(os.environ.get(VARIABLE) or NAME)


_GIVEN: list[str] | None = None  # the arguments of the command, if they differ from the arguments of the process


def arguments() -> list[str]:
    """Return the arguments of the command line."""
    return list(sys.argv[1:] if _GIVEN is None else _GIVEN)


def remember(words: Sequence[str] | None = None) -> None:
    """Store the arguments of the command line, by default the arguments of the process.

    Hints will contain the program's path if it was called by its path and is not on PATH.
    """
    global _GIVEN
    _GIVEN = None if words is None else list(words)
    program = sys.argv[0] if sys.argv else ""
    if VARIABLE not in os.environ and Path(program).name == NAME and shutil.which(NAME) is None:
        os.environ[VARIABLE] = program


def installing(extra: str, *, root: Path = ROOT) -> str:
    """Return the command that installs an extra: with the launcher in a checkout, otherwise with pip."""
    if (root / "launcher.py").is_file():
        launcher = "./rayproof" if Path.cwd() == root else str(root / "rayproof")
        return f"{shlex.quote(launcher)} install {extra}"
    try:
        requirements = requires("rayproof") or []
    except PackageNotFoundError:
        requirements = []
    needed = [text.partition(";")[0].strip() for text in requirements if f"extra=='{extra}'" in _plainly(text)]
    return shlex.join([sys.executable, "-m", "pip", "install", *needed])


def _plainly(text: str) -> str:
    return text.replace(" ", "").replace('"', "'")
