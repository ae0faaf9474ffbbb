"""A PyVista picture of every case's scene, all drawn in one child process that may die without harm."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Any

from reports.publish import gl

OURS, THEIRS = "tracer-float32", "analytic"


def draw_pictures(folder: Path, results: dict[str, Any], progress: Callable[[str], None] | None = None) -> str | None:
    """Draw DIR/pictures/<case>.png for each case, note it in `results`, and return why any were left out, or None.

    `progress` is told the name of each case drawn. `results` is changed in place (`picture` of each case); the caller
    writes it.
    """
    jobs = [job for case in results["cases"] if (job := _job(folder, case)) is not None]
    for case in results["cases"]:
        case["picture"] = None
    if not jobs:
        return None
    reason = gl.why_not()
    if reason:
        return reason
    by_name = {case["name"]: case for case in results["cases"]}
    drawn, current, failures = 0, "the first case", []
    # stderr to a file: a pipe that nobody reads would stop a child that complains at length.
    with (
        tempfile.TemporaryFile() as complaints,
        subprocess.Popen(
            [sys.executable, "-m", "reports.publish.picture_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            env=gl.drawing_environment(),
            cwd=Path(__file__).parents[2],
            text=True,
            encoding="utf-8",
        ) as child,
    ):
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            child.stdin.write(json.dumps(jobs))
            child.stdin.close()
        except BrokenPipeError:
            pass  # It died at once; its exit status says so below.
        for line in child.stdout:
            try:
                report = json.loads(line)
            except json.JSONDecodeError:
                continue  # What a graphics driver says, or half a line of a child that died.
            if report["state"] == "started":
                current = report["name"]
            elif report["state"] == "failed":
                failures.append(f"{report['name']}: {report['why']}")
            else:
                drawn += 1
                by_name[report["name"]]["picture"] = picture_path(by_name[report["name"]])
                if progress is not None:
                    progress(report["name"])
        status = child.wait()
        complaints.seek(0)
        last = complaints.read().decode(errors="replace").strip().splitlines()[-1:]
    if status:
        how = f"signal {-status}" if status < 0 else f"exit code {status}" + (f", {last[0][:200]}" if last else "")
        return f"drawing ended at {current} ({how}); {drawn} of {len(jobs)} drawn"
    if failures:
        more = f" and {len(failures) - 1} more" if len(failures) > 1 else ""
        return f"{drawn} of {len(jobs)} drawn; {failures[0]}{more}"
    return None


def picture_path(case: dict[str, Any]) -> str | None:
    """Return where a case's picture goes below the results folder: named as the run named its scene, or None."""
    parts = PurePosixPath(case.get("scene") or "").parts
    if len(parts) < 2 or parts[0] != "scenes" or ".." in parts:
        return None
    return PurePosixPath("pictures", *parts[1:]).with_suffix(".png").as_posix()


def inside(folder: Path, relative: str) -> bool:
    """Return whether `relative` names a file below `folder`; results.json may come from anywhere."""
    try:
        path = (folder / relative).resolve()
        return path.is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError):
        return False


def _job(folder: Path, case: dict[str, Any]) -> dict[str, Any] | None:
    """Return what the child must know to draw a case, or None if the run kept no scene of it."""
    scene = case.get("scene")
    if not scene or not inside(folder, scene) or picture_path(case) is None:
        return None
    images = {render.get("renderer"): render.get("image") for render in case.get("renders", [])}

    def answers(renderer: str) -> str | None:
        image = images.get(renderer)
        return str((folder / image).resolve()) if image and inside(folder, image) else None

    return {
        "name": case["name"],
        "scene": str((folder / scene).resolve()),
        "ours": answers(OURS),
        "theirs": answers(THEIRS),
        "stage": case.get("stage"),
        "picture": str((folder / str(picture_path(case))).resolve()),
    }
