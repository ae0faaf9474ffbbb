"""The program: from its Python wheel or on the PATH; one picture a call, and nothing left behind."""

import re
import shutil
import subprocess
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

INSTALL = "Tachyon is not installed; pip install --no-deps passagemath-tachyon, or apt-get install tachyon-bin-nox."
WHITE = 65535
# Full shading with shadows, no highlights. One thread: several renders run at once.
# Tachyon ignores hits nearer than this, and triangles whose determinant with the ray is below it. Tachyon's units are
# metres: larger ones would miss triangles, smaller ones take rounding for blockers.
EPSILON = 1e-9  # m and m^2; tachyon.h
OPTIONS = ("-fullshade", "-shade_nullphong", "-numthreads", "1", "-format", "PPM48")


def executable() -> str | None:
    """Return the program's path, or None; the wheel's comes first, whose version pip knows."""
    wheels = find_spec("sage_wheels")
    for folder in wheels.submodule_search_locations or () if wheels is not None else ():
        if (path := Path(folder) / "bin" / "tachyon").is_file():
            return str(path)
    return shutil.which("tachyon")


def missing() -> str | None:
    """Return how to install the program, or None if it is there."""
    return INSTALL if executable() is None else None


def command() -> str:
    """Return the program's path.

    Raises:
        RuntimeError: it is not installed.

    """
    path = executable()
    if path is None:
        raise RuntimeError(INSTALL)
    return path


@cache
def version() -> str:
    """Return program and version."""
    said = subprocess.run([command()], capture_output=True, text=True, check=False, timeout=60)
    found = re.search(r"Version (\S+)", said.stdout)
    if found is None:
        raise RuntimeError(f"tachyon names no version: {(said.stdout + said.stderr).strip()[:200]!r}")
    return f"Tachyon {found[1]}"


def picture(scene: str, width: int, height: int) -> np.ndarray:
    """Return the codes at the centres of width x height pixels, (height, width, 3), 0 to 65535.

    Tachyon's coordinates are left-handed, so its pictures are mirrored; and it samples the corners of pixels, so of
    twice as many in each direction every second is a centre.

    Raises:
        RuntimeError: it failed; the message ends with what it said.

    """
    with tempfile.TemporaryDirectory(prefix="rayproof-tachyon-") as name:
        folder = Path(name)
        (folder / "scene.dat").write_text(scene, encoding="ascii")
        size = ("-res", str(2 * width), str(2 * height))
        said = subprocess.run(
            [command(), "scene.dat", *OPTIONS, *size, "-o", "picture.ppm"],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        path = folder / "picture.ppm"
        if said.returncode != 0 or not path.is_file():
            raise RuntimeError(f"Tachyon ended with {said.returncode}: {(said.stdout + said.stderr).strip()[-500:]}")
        content = path.read_bytes()
    header = f"P6\n{2 * width} {2 * height}\n{WHITE}\n".encode()
    if not content.startswith(header):
        raise RuntimeError(f"Tachyon wrote a picture that begins with {content[:40]!r}")
    codes = np.frombuffer(content, ">u2", offset=len(header)).reshape(2 * height, 2 * width, 3)
    return codes[1::2, ::-1][:, 1::2].astype(np.float64)
