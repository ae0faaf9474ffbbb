"""Radiance's own programs, driven as subprocesses: oconv sorts a scene into an octree, rtrace follows rays through it.

Source: the manual pages oconv(1) and rtrace(1) of Radiance 6.0, and the package pyradiance that carries the programs.
"""

import os
import re
import subprocess
import sys
from functools import lru_cache
from importlib.metadata import version as installed_version
from importlib.util import find_spec
from pathlib import Path

import numpy as np

# No jitter, no substructuring and no testing of only some shadows (-dt 0 -dc 1: without it rtrace guesses), no ambient
# light, nothing left out for being faint. -w silences warnings; what is an error still ends the program.
OPTIONS = (
    *("-h", "-w", "-n", "1", "-fdd", "-ab", "0", "-av", "0", "0", "0"),
    *("-dj", "0", "-dt", "0", "-dc", "1", "-ds", "0", "-dr", "0", "-lr", "0", "-lw", "0", "-st", "0"),
)
NUMBER = 8  # bytes
# Text amid binary: a name ends at a tab, its ten numbers follow.
HIT = re.compile(rb"([^\t]+)\t(.{%d})" % (10 * NUMBER), re.DOTALL)


@lru_cache(maxsize=1)
def folder() -> Path | None:
    """Return where pyradiance keeps its programs and their library, or None where it is not installed."""
    found = find_spec("pyradiance")
    return Path(found.origin).parent if found is not None and found.origin is not None else None


def missing() -> str | None:
    """Return why the programs cannot be started, or None if they can."""
    home = folder()
    if home is None:
        return "Radiance is not installed; pip install pyradiance."
    absent = [name for name in ("oconv", "rtrace") if not os.access(_program(home, name), os.X_OK)]
    return f"pyradiance carries no {' and no '.join(absent)} for this machine." if absent else None


@lru_cache(maxsize=1)
def version() -> str:
    """Return program, its version and the package that carries it."""
    said = _run("rtrace", "-version").decode().strip().removeprefix("RADIANCE ")
    return f"Radiance rtrace {said} (pyradiance {installed_version('pyradiance')})"


def octree(place: Path, name: str, text: str) -> None:
    """Write a scene's `text` as `name`.rad into the folder `place`, and its octree beside it.

    The octree names the scene's file and rtrace reads both: a frozen octree would keep 31 bits of each number.
    """
    (place / f"{name}.rad").write_text(text, encoding="ascii")
    (place / f"{name}.oct").write_bytes(_run("oconv", f"{name}.rad", place=place))


def radiances(place: Path, name: str, rays: np.ndarray, limited: bool) -> np.ndarray:
    """Return the radiance (n, 3) along `rays`, (n, 6) origins and directions, in the scene `name`.

    `limited` rays end at the tips of their direction vectors.
    """
    data = _trace(place, name, rays, "-ov", limited=limited)
    if len(data) != len(rays) * 3 * NUMBER:
        raise RuntimeError(f"rtrace answered {len(data)} bytes to {len(rays)} rays")
    return np.frombuffer(data, dtype="<f8").reshape(len(rays), 3)


def first_hits(place: Path, name: str, rays: np.ndarray, limited: bool) -> tuple[list[bytes], np.ndarray]:
    """Return the name of the surface that each ray meets first, "*" for none, and ten numbers (n, 10).

    These are the ray's unit direction, the distance to the hit (1e10 for none), its position and its normal.
    """
    data = _trace(place, name, rays, "-osdLpN", limited=limited)
    found = HIT.findall(data)
    names, numbers = [name for name, _ in found], b"".join([ten for _, ten in found])
    # Whatever lies between two records is missing in the sum.
    if len(found) != len(rays) or len(found) + len(b"".join(names)) + len(numbers) != len(data):
        raise RuntimeError(f"rtrace's answer to {len(rays)} rays holds {len(found)} hits in {len(data)} bytes")
    return names, np.frombuffer(numbers, dtype="<f8").reshape(-1, 10)


def _trace(place: Path, name: str, rays: np.ndarray, output: str, *, limited: bool) -> bytes:
    limit = "-ld+" if limited else "-ld-"
    data = np.ascontiguousarray(rays, dtype="<f8").tobytes()
    return _run("rtrace", *OPTIONS, limit, output, f"{name}.oct", place=place, data=data)


def _run(program: str, *arguments: str, place: Path | None = None, data: bytes = b"") -> bytes:
    """Return what a program writes; raise RuntimeError with its own words if it fails."""
    home = folder()
    if home is None:
        raise RuntimeError("Radiance is not installed")
    # Nothing of the user's own Radiance settings (RAYPATH, .rtracerc) takes part.
    environment = {"PATH": str(home / "bin"), "RAYPATH": str(home / "lib"), "LC_ALL": "C"}
    if sys.platform == "win32":
        environment["SYSTEMROOT"] = os.environ.get("SYSTEMROOT", "")
    command = [str(_program(home, program)), *arguments]
    done = subprocess.run(command, input=data, capture_output=True, env=environment, cwd=place, check=False)
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise RuntimeError(f"{program} ended with {done.returncode}: {said[-1] if said else 'it said nothing'}")
    return done.stdout


def _program(home: Path, name: str) -> Path:
    return home / "bin" / (f"{name}.exe" if sys.platform == "win32" else name)
