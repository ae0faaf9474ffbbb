"""The name and arguments by which rayproof was started, for hints that can be pasted into a shell."""

import os
import shlex
import shutil
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from rayproof import ROOT

VARIABLE = "RAYPROOF_CALLED"  # set by the launcher of a checkout, and by `remember` for the processes of a run
NAME = "rayproof"


def called() -> str:
    """Return what to write before a command's arguments: ./rayproof in a checkout, or rayproof, for a shell."""
    return shlex.quote(os.environ.get(VARIABLE) or NAME)


_GIVEN: list[str] | None = None  # what the command line was given, where it was not the process's own


def arguments() -> list[str]:
    """Return the words that the command line was given."""
    return list(sys.argv[1:] if _GIVEN is None else _GIVEN)


def remember(given: Sequence[str] | None = None) -> None:
    """Remember the words that the command line was given, the process's own if None.

    Let hints name the program by its path where it was called so and is on nobody's PATH.
    """
    global _GIVEN
    _GIVEN = None if given is None else list(given)
    program = sys.argv[0] if sys.argv else ""
    if VARIABLE not in os.environ and Path(program).name == NAME and shutil.which(NAME) is None:
        os.environ[VARIABLE] = program


def installing(extra: str, *, root: Path = ROOT) -> str:
    """Return the command that installs an extra: by a checkout's launcher, or by pip where rayproof was installed."""
    if (root / "launcher.py").is_file():
        launcher = "./rayproof" if Path.cwd() == root else str(root / "rayproof")
        return f"{shlex.quote(launcher)} install {extra}"
    try:
        known = requires("rayproof") or []
    except PackageNotFoundError:
        known = []
    needed = [text.partition(";")[0].strip() for text in known if f"extra=='{extra}'" in _plainly(text)]
    return shlex.join([sys.executable, "-m", "pip", "install", *needed])


def _plainly(text: str) -> str:
    return text.replace(" ", "").replace('"', "'")
