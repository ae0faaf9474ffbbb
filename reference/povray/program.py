"""The program: where it is, what it is called with, and a folder that nothing of it survives."""

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

INSTALL = "POV-Ray is not installed; apt-get install --no-install-recommends povray (or your system's package of it)."
# No antialiasing: one sample at the pixel's centre. 16 bits without gamma, and no dithering, which is random. Bounds
# that we give stay: POV-Ray would take those of unions for needless. One thread: several renders run at once.
# POV-Ray ignores what blocks a feeler within 1e-3 of its units from either end: a millionth of a metre at this scale.
# Unlit scenes keep to metres, because nothing farther than 1e7 units is hit.
LIT_SCALE = 1024.0
SHADOW_TOLERANCE = 1e-3  # units; POV-Ray 3.7, render/trace.cpp
DEPTH_TOLERANCE = 1e-6  # units; shape/*.cpp
OPTIONS = {
    "Output_File_Type": "P",
    "Bits_Per_Color": "16",
    "File_Gamma": "1.0",
    "Dither": "off",
    "Antialias": "off",
    "Display": "off",
    "Remove_Bounds": "off",
    "Split_Unions": "off",
    "Work_Threads": "1",
}


def missing() -> str | None:
    """Return how to install the program, or None if it is there."""
    return INSTALL if shutil.which("povray") is None else None


@cache
def version() -> str:
    """Return program and version."""
    # It starts nothing and writes this to standard error.
    said = subprocess.run(["povray", "--version"], capture_output=True, text=True, check=False, timeout=60)
    found = re.search(r"POV-Ray (\d\S*)", said.stderr + said.stdout)
    if found is None:
        raise RuntimeError(f"povray --version names no version: {(said.stderr + said.stdout).strip()[:200]!r}")
    return f"POV-Ray {found[1]}"


@contextmanager
def workshop(scene: str) -> Iterator[Path]:
    """Yield a folder that holds `scene` as scene.pov, and remove it with all that was written there.

    Debian's configuration lets POV-Ray write only into the working folder and /tmp.
    """
    with tempfile.TemporaryDirectory(prefix="rayproof-povray-") as name:
        folder = Path(name)
        (folder / "scene.pov").write_text(scene, encoding="ascii")
        yield folder


def trace(folder: Path, *, width: int, height: int, renders: Mapping[str, Sequence[str]]) -> None:
    """Render scene.pov into several images at once: file name -> further options.

    A render spends most of its time asleep (POV-Ray's front end polls), which is why they run at once.

    Raises:
        RuntimeError: a render failed; the message ends with what POV-Ray said.

    """
    # Home is the workshop too: no settings of the user's, and nothing left behind among them.
    environment = {**os.environ, "HOME": str(folder), "POVINC": str(folder)}
    size = [f"Width={width}", f"Height={height}", *(f"{name}={value}" for name, value in OPTIONS.items())]
    running = {
        image: subprocess.Popen(
            ["povray", "Input_File_Name=scene.pov", f"Output_File_Name={image}", *size, *options],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        for image, options in renders.items()
    }
    try:
        said = {image: process.communicate()[1] for image, process in running.items()}
    finally:
        for process in running.values():
            process.kill()
            process.wait()
    for image, process in running.items():
        if process.returncode != 0 or not (folder / image).is_file():
            raise RuntimeError(f"POV-Ray ended with {process.returncode}: {said[image].strip()[-500:]}")
