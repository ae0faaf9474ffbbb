"""Whether VTK can draw here, asked in a child process until it once could: only a yes is remembered.

A no may be the moment's: too little memory, a driver being updated. Kept, it would cost every later run its pictures.

Without OpenGL libraries VTK does not raise: it kills the process inside `pyvista.Plotter()`. So nothing may touch a
plotter in this process, and none before this probe said yes.
"""

import contextlib
import hashlib
import json
import os
import subprocess
import sys
import threading
from concurrent.futures import Future
from importlib.metadata import version
from pathlib import Path

from platformdirs import user_cache_path

from rayproof.reports import HOLDER
from rayproof.reports.results.atomic import write_text

INSTALL = "apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri"
_SECONDS = 60.0
_VARIABLES = (
    "VTK_DEFAULT_OPENGL_WINDOW", "DISPLAY", "WAYLAND_DISPLAY", "LD_LIBRARY_PATH", "LD_PRELOAD", "LIBGL_ALWAYS_SOFTWARE",
    "LIBGL_DRIVERS_PATH", "GALLIUM_DRIVER", "MESA_LOADER_DRIVER_OVERRIDE", "__EGL_VENDOR_LIBRARY_FILENAMES",
)  # fmt: skip
_PROBE = """
import sys
from rayproof.reports.processes.parent_death import end_with_parent
end_with_parent(int(sys.argv[1]))
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 24))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
assert image.std() > 1, "the image is blank"
"""


def drawing_environment() -> dict[str, str]:
    """Return the environment for a child process that draws: EGL on Linux, unless the user chose otherwise."""
    environment = dict(os.environ)
    if sys.platform.startswith("linux"):
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        # A picture is small, and waiting for Mesa's threads costs more than they do of it.
        environment.setdefault("LP_NUM_THREADS", "0")
    return environment


def recording_environment() -> dict[str, str]:
    """Return the environment for a child process that only fills plotters: VTK dies if it looks for a screen."""
    environment = dict(os.environ)
    if sys.platform.startswith("linux"):
        environment["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkOSOpenGLRenderWindow"
    return environment


def why_not(cache: Path | None = None) -> str | None:
    """Return why VTK cannot draw here, or None if it can; that it can is kept in `cache` until something changes."""
    cache = cache or user_cache_path("rayproof")
    # One file per configuration, so that shells with different settings do not overwrite each other's answer.
    path = cache / f"gl-{_key()}.json"
    try:
        if json.loads(path.read_text(encoding="utf-8"))["draws"] is True:
            return None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        pass  # Never asked, or what was written is no answer: ask.
    answer = probe()
    if answer is None:
        # A home that cannot be written costs a second at the next start, nothing else.
        with contextlib.suppress(OSError):
            write_text(path, json.dumps({"draws": True}))
    return answer


def ask() -> "Future[str | None]":
    """Ask `why_not` while other work goes on; nobody waits for a question that is still open at the end."""
    answer: Future[str | None] = Future()

    def put() -> None:
        try:
            answer.set_result(why_not())
        except BaseException as error:
            answer.set_exception(error)

    threading.Thread(target=put, daemon=True).start()
    return answer


def probe() -> str | None:
    """Draw a sphere in a child process and return why that failed, or None."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", _PROBE, str(os.getpid())],
            cwd=HOLDER,
            env=drawing_environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"OpenGL did not draw within {_SECONDS:.0f} s"
    if child.returncode == 0:
        return None
    if child.returncode < 0:
        return f"OpenGL is missing (VTK ended with signal {-child.returncode}); on Debian: {INSTALL}"
    last = child.stderr.decode(errors="replace").strip().splitlines()[-1:] or [f"exit code {child.returncode}"]
    return f"VTK cannot draw: {last[0][:200]}"


def _key() -> str:
    """Return what the answer depends on, as a short hash."""
    facts = [sys.executable, version("pyvista"), version("vtk")]
    facts += [f"{name}={drawing_environment().get(name, '')}" for name in _VARIABLES]
    # The package manager rewrites this file when it installs or removes a library: a remembered yes then ends.
    linker = Path("/etc/ld.so.cache")
    facts.append(str(linker.stat().st_mtime_ns) if linker.exists() else "")
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:16]
