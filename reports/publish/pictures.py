"""A PyVista picture of every case's scene and its 3-D view, all made in one child process that may die without harm.

Pictures need OpenGL; views do not, and are made without, too.
"""

import contextlib
import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path, PurePosixPath
from typing import IO, Any

from reports.cache import pictures
from reports.cache.store import Store
from reports.publish import gl
from reports.publish.kept import inside

OURS, THEIRS = "tracer-float32", "analytic"


def draw_pictures(folder: Path, results: dict[str, Any], progress: Callable[[str], None] | None = None) -> str | None:
    """Draw DIR/pictures/<case>.png and write its view for each case; return why any pictures were left out, or None.

    `progress` is told the name of each case drawn. `results` is changed in place (`picture` and `view` of each case);
    the caller writes it.
    """
    with Drawing(folder, progress) as drawing:
        for case in results["cases"]:
            drawing.submit(case)
    return drawing.reason


class Drawing:
    """Pictures and views made in a child process while other work goes on: submit cases, leave the block, ask why.

    Whether the machine can draw is asked when the block is entered: the answer takes seconds, the first time. The child
    starts with the first case that can be drawn. What `store` has of the very same images is taken from there.
    """

    def __init__(
        self, folder: Path, progress: Callable[[str], None] | None = None, *, store: Store | None = None
    ) -> None:
        self._store = store
        self._jobs: dict[str, tuple[str, dict[str, Any]]] = {}  # what is to be kept when it is drawn, and its question
        self.reason: str | None = None  # why pictures were left out; complete when the block is left
        self._folder = folder
        self._progress = progress
        self._cases: dict[str, dict[str, Any]] = {}
        self._drawn = 0
        self._pictures = True  # whether the machine can draw
        self._asked: Future[str | None] | None = None
        self._current = "the first case"
        self._failures: list[str] = []
        self._child: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        # stderr to a file: a pipe that nobody reads would stop a child that complains at length.
        self._complaints: IO[bytes] | None = None

    def __enter__(self) -> "Drawing":
        self._asked = gl.ask()
        return self

    def submit(self, case: dict[str, Any]) -> None:
        """Have a case drawn; its `picture` and `view` are set when they are there."""
        case["picture"] = case["view"] = None
        job = _job(self._folder, case)
        if job is None:
            return
        if self._asked is not None:
            self.reason, self._asked = self._asked.result(), None
            self._pictures = self.reason is None
        if not self._pictures:
            job["picture"] = None
        if self._store is not None:
            key = pictures.question(job)
            if pictures.recall(self._store, key, job):
                self._set(case)
                return
            self._jobs[case["name"]] = (key, job)
        if self._child is None:
            self._start()
        self._cases[case["name"]] = case
        assert self._child is not None
        assert self._child.stdin is not None
        with contextlib.suppress(OSError):  # it died; its exit status says so at the end
            self._child.stdin.write(json.dumps(job) + "\n")
            self._child.stdin.flush()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._child is None:
            return
        if kind is not None:
            self._child.kill()
        assert self._child.stdin is not None
        with contextlib.suppress(OSError):  # what was still in the buffer went to a child that is gone
            self._child.stdin.close()
        assert self._reader is not None
        self._reader.join()
        assert self._child.stdout is not None
        self._child.stdout.close()
        self.reason = self._conclude(self._child.wait()) or self.reason

    def _start(self) -> None:
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (closed when the block is left)
        self._child = subprocess.Popen(
            [sys.executable, "-m", "reports.publish.picture_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env=gl.drawing_environment() if self._pictures else gl.recording_environment(),
            cwd=Path(__file__).parents[2],
            text=True,
            encoding="utf-8",
            # Ctrl-C is the main process's to answer: a child that it reached first would die with its work.
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        """Take down what the child reports."""
        assert self._child is not None
        for line in self._child.stdout or ():
            try:
                report = json.loads(line)
            except json.JSONDecodeError:
                continue  # What a graphics driver says, or half a line of a child that died.
            name = report["name"]
            if report["state"] == "started":
                self._current = name
            elif report["state"] == "failed":
                self._failures.append(f"{name}: {report['why']}")
            else:
                self._drawn += 1
                self._set(self._cases[name])
                if self._store is not None:
                    pictures.keep(self._store, *self._jobs.pop(name))

    def _set(self, case: dict[str, Any]) -> None:
        """Say of a case where its picture and view are."""
        case["picture"] = picture_path(case) if self._pictures else None
        case["view"] = view_path(case)
        if self._progress is not None:
            self._progress(case["name"])

    def _conclude(self, status: int) -> str | None:
        """Return why pictures were left out, given how the child ended."""
        assert self._complaints is not None
        with self._complaints as complaints:
            complaints.seek(0)
            last = complaints.read().decode(errors="replace").strip().splitlines()[-1:]
        total = len(self._cases)
        if status:
            how = f"signal {-status}" if status < 0 else f"exit code {status}" + (f", {last[0][:200]}" if last else "")
            return f"drawing ended at {self._current} ({how}); {self._drawn} of {total} drawn"
        if self._failures:
            more = f" and {len(self._failures) - 1} more" if len(self._failures) > 1 else ""
            return f"{self._drawn} of {total} drawn; {self._failures[0]}{more}"
        return None


def picture_path(case: dict[str, Any]) -> str | None:
    """Return where a case's picture goes below the results folder: named as the run named its scene, or None."""
    return _beside(case, ".png")


def view_path(case: dict[str, Any]) -> str | None:
    """Return where a case's 3-D view goes below the results folder, or None."""
    return _beside(case, ".view.js")


def _beside(case: dict[str, Any], suffix: str) -> str | None:
    parts = PurePosixPath(case.get("scene") or "").parts
    if len(parts) < 2 or parts[0] != "scenes" or ".." in parts:
        return None
    return PurePosixPath("pictures", *parts[1:]).with_suffix(suffix).as_posix()


def _job(folder: Path, case: dict[str, Any]) -> dict[str, Any] | None:
    """Return what the child must know to draw a case, or None if the run kept no scene of it."""
    scene = case.get("scene")
    if not scene or not inside(folder, scene) or picture_path(case) is None:
        return None
    return {
        "name": case["name"],
        "scene": str((folder / scene).resolve()),
        "folder": str(folder.resolve()),
        "case": {key: case.get(key) for key in ("renders", "pixels")},
        **_compared(case),
        "stage": case.get("stage"),
        "picture": str((folder / str(picture_path(case))).resolve()),
        "view": view_path(case),
    }


def _compared(case: dict[str, Any]) -> dict[str, str | None]:
    """Return whose answers are drawn: the tracer's, or whatever else was put under test, and a reference's."""
    names = [str(render.get("renderer")) for render in case.get("renders", [])]
    ours = OURS if OURS in names else next(iter(names), None)
    others = [name for name in names if name != ours and not name.startswith("tracer-")]
    return {"ours": ours, "theirs": THEIRS if THEIRS in others else next(iter(others), None)}
