"""A Python with Blender in it: where it is, and a folder in which it renders and nothing survives.

`bpy` is never imported here: it takes a second, 400 MB, and cannot be unloaded.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path

VARIABLE = "RAYPROOF_BLENDER_PYTHON"
INSTALL = (
    f"Cycles is not installed; pip install bpy into an environment of a Python that it is made for, and set {VARIABLE}"
    " to that environment's python."
)
SCRIPT = Path(__file__).with_name("inside.py")


def interpreter() -> str | None:
    """Return the path of a Python that has bpy, or None."""
    if named := os.environ.get(VARIABLE):
        return named if Path(named).is_file() else None
    return sys.executable if find_spec("bpy") is not None else None


def missing() -> str | None:
    """Return how to install it, or None if it is there."""
    return INSTALL if interpreter() is None else None


@cache
def version() -> str:
    """Return program and version."""
    said = _run(["-c", "import bpy; print('Blender', bpy.app.version_string)"])
    found = re.search(r"Blender (\d\S*)", said)
    if found is None:
        raise RuntimeError(f"bpy names no version: {said.strip()[-200:]!r}")
    return f"Cycles of Blender {found[1]}"


@contextmanager
def workshop() -> Iterator[Path]:
    """Yield a folder, and remove it with all that was written there."""
    with tempfile.TemporaryDirectory(prefix="rayproof-cycles-") as name:
        yield Path(name)


def render(folder: Path) -> None:
    """Render the task that lies in `folder`.

    Raises:
        RuntimeError: it failed; the message ends with what Blender said.

    """
    _run([str(SCRIPT), str(folder)], home=folder)


def _run(arguments: list[str], home: Path | None = None) -> str:
    python = interpreter()
    if python is None:
        raise RuntimeError(INSTALL)
    # Home is the workshop too: no settings of the user's, and nothing left behind among them.
    extra = {} if home is None else {"HOME": str(home), "BLENDER_USER_RESOURCES": str(home / "blender")}
    said = subprocess.run(
        [python, "-I", *arguments],
        env={**os.environ, **extra},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if said.returncode != 0:
        raise RuntimeError(f"Blender's Python ended with {said.returncode}: {said.stdout.strip()[-500:]}")
    return said.stdout
