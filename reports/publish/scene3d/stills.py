"""The choice of cases with stills, and the child process that draws them with PyVista.

A run draws the failing cases and the worst twelve; `rayproof report DIR --draw` draws others. Without OpenGL libraries
VTK raises no exception but ends its process. So only a child process uses a plotter, and its exit shows whether OpenGL
is present.
"""

import contextlib
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path, PurePosixPath
from typing import Any

from rayproof import HOLDER
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import amend, amending, briefs, named
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.images import inside
from rayproof.reports.results.outcomes import Outcome

WORST = 12  # cases that are drawn with any verdict
MOST = 100  # failing cases of a run that are drawn by default; a still takes a fifth of a second
FAILING = (Outcome.FAIL, Outcome.REFERENCE_SUSPECT)
OURS, THEIRS = "tracer-float32", "analytic"
DIGEST = "rayproof"  # the key of a PNG's text that contains the digest of its inputs
PATIENCE = 120.0  # s without output after which a child is ended
GLANCE = 0.05  # s between tests whether it has ended
PARTING = 5.0  # s from the kill of a process to its end
INSTALL = "apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri"


def drawn_usually(cases: Sequence[CaseRecord]) -> list[CaseRecord]:
    """Return the cases of a run that are drawn by default: the failing ones and the worst twelve."""
    first = worst_first(cases)[:MOST]
    return [case for place, case in enumerate(first) if place < WORST or case["verdict"] in FAILING]


def chosen(cases: Sequence[CaseRecord], which: str) -> Sequence[CaseRecord]:
    """Return the cases of `which`: `all`, `worst:N`, or the name of a case.

    Raises:
        LookupError: there is no case of this name.
        ValueError: N is no number from 1 on.

    """
    if which == "all":
        return cases
    if which.startswith("worst:"):
        count = which.removeprefix("worst:")
        if not re.fullmatch("[0-9]{1,9}", count) or int(count) < 1:
            raise ValueError(f"worst:N draws the N worst cases, from 1 on, got {which}")
        return worst_first(cases)[: int(count)]
    case = named(cases, which)
    if case is None:
        raise LookupError(f"there is no case called {which}; `all` and `worst:N` draw several")
    return [case]


def draw_stills(
    folder: Path, cases: Sequence[CaseRecord], which: Sequence[CaseRecord], *, seconds: float = PATIENCE
) -> tuple[int, str | None]:
    """Draw DIR/pictures/<case>.png of `which` of a run's cases and write the paths into their records.

    Return the number of cases with a still, and the reason why others have none, or None. A still of the same scene and
    images is not drawn again. The child is ended after `seconds` without output.
    """
    jobs = {case["name"]: job for case in which if (job := _job(folder, case)) is not None}
    drawn_before = {name for name, job in jobs.items() if _digest_in(folder / job["picture"]) == job["digest"]}
    drawn, why = _draw_in_child([job for name, job in jobs.items() if name not in drawn_before], seconds)
    with amending(cases):
        for name in jobs:
            case = named(cases, name)
            if case is not None and name in drawn_before | drawn:
                amend(cases, case, picture=jobs[name]["picture"])
    return len(drawn_before | drawn), why


def remove_stale(folder: Path, cases: Sequence[CaseRecord]) -> None:
    """Remove the stills of an earlier run that none of a run's records names."""
    named_by_records = {folder / picture for case in briefs(cases) if (picture := case.get("picture"))}
    for path in {*(folder / "pictures").rglob("*.png")} - named_by_records:
        path.unlink()


def picture_path(case: CaseRecord) -> str | None:
    """Return the path of a case's still in the results folder, named like its scene file; None without a scene."""
    parts = PurePosixPath(case.get("scene") or "").parts
    if len(parts) < 2 or parts[0] != "scenes" or ".." in parts:
        return None
    return PurePosixPath("pictures", *parts[1:]).with_suffix(".png").as_posix()


def compared(case: CaseRecord) -> tuple[str | None, str | None]:
    """Return the names of the subject and the reference whose images are shown."""
    names = [str(render.get("renderer")) for render in case.get("renders", [])]
    subject = OURS if OURS in names else next(iter(names), None)
    references = [name for name in names if name != subject and not name.startswith("tracer-")]
    return subject, THEIRS if THEIRS in references else next(iter(references), None)


def drawing_environment() -> dict[str, str]:
    """Return the environment for a process that draws: EGL on Linux, unless the user chose otherwise."""
    environment = dict(os.environ)
    if sys.platform.startswith("linux"):
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        # For a small picture, waiting for Mesa's threads takes longer than their share of the work.
        environment.setdefault("LP_NUM_THREADS", "0")
    return environment


@lru_cache(maxsize=1)
def why_not() -> str | None:
    """Return why VTK cannot draw here, or None if it can."""
    return _draw_in_child([None], PATIENCE)[1]


def _job(folder: Path, case: CaseRecord) -> dict[str, Any] | None:
    """Return the child's inputs for the drawing of a case, or None if the run stored no scene of it."""
    scene, picture = case.get("scene"), picture_path(case)
    if not scene or picture is None or not inside(folder, scene):
        return None
    shown = {name: case.get(name) for name in ("name", "scene", "stage", "pixels")}
    shown["renders"] = [{key: render.get(key) for key in ("renderer", "image")} for render in case.get("renders", [])]
    return {"folder": str(folder.resolve()), "picture": picture, "case": shown, "digest": _digest(folder, shown)}


def _digest(folder: Path, case: Mapping[str, Any]) -> str:
    """Return a digest of all that a still depends on: the files that it shows, the code, and the libraries."""
    digest = hashlib.sha256(json.dumps([case, _code()]).encode())
    for name in filter(None, (case["scene"], case["pixels"], *(render["image"] for render in case["renders"]))):
        with contextlib.suppress(OSError):
            digest.update((folder / name).read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _code() -> list[str]:
    own = sorted(path for path in Path(__file__).parent.iterdir() if path.suffix in (".py", ".json"))
    return [*(hashlib.sha256(path.read_bytes()).hexdigest() for path in own), version("pyvista"), version("vtk")]


def _digest_in(path: Path) -> str | None:
    """Return the digest of the inputs from a PNG file of rayproof, or None."""
    try:
        with path.open("rb") as file:
            # The text precedes the picture; an import of Pillow would take a twentieth of a second.
            match = re.search(DIGEST.encode() + rb"\0([0-9a-f]{64})", file.read(4096))
    except OSError:
        return None
    return None if match is None else match[1].decode()


def _draw_in_child(jobs: Sequence[Mapping[str, Any] | None], seconds: float) -> tuple[set[str], str | None]:
    """Draw jobs in a process of `plotting`; return the names of finished ones, and the reason if others are missing.

    A job of None draws a ball as a test of OpenGL.
    """
    if not jobs:
        return set(), None
    # Files, not pipes: they need no reader while the child works, and the output of a failing driver blocks nothing.
    with (
        tempfile.TemporaryFile() as requests,
        tempfile.TemporaryFile() as answer,
        tempfile.TemporaryFile() as complaints,
    ):
        requests.write("".join(json.dumps(job) + "\n" for job in jobs).encode())
        requests.seek(0)
        process = subprocess.Popen(
            [sys.executable, "-m", "rayproof.reports.publish.scene3d.plotting", str(os.getpid())],
            stdin=requests,
            stdout=answer,
            stderr=complaints,
            env=drawing_environment(),
            cwd=HOLDER,
            # Ctrl-C is handled by this process.
            start_new_session=True,
        )
        hung = _waited_in_vain(process, answer.fileno(), seconds)
        answer.seek(0)
        complaints.seek(0)
        reports = _reports(answer.read().decode(errors="replace"))
        last = complaints.read().decode(errors="replace").strip().splitlines()[-1:]
    failures = [f"{report['name']}: {report['why']}" for report in reports if report["why"] is not None]
    drawn = {report["name"] for report in reports if report["why"] is None}
    state, count = process.poll(), f"{len(drawn)} of {len(jobs)} drawn"
    if hung:
        return drawn, f"{count}; drawing was stopped, since nothing was drawn for {seconds:g} s"
    if state != 0 and not reports and state is not None and state < 0:
        return drawn, f"OpenGL is missing (VTK ended with signal {-state}); on Debian: {INSTALL}"
    if state != 0:
        how = f"exit code {state}" if state is None or state > 0 else f"signal {-state}"
        return drawn, f"{count}; VTK cannot draw: {last[0][:200] if last else how}"
    if failures:
        more = f" and {len(failures) - 1} more" if len(failures) > 1 else ""
        return drawn, f"{count}; {failures[0]}{more}"
    return drawn, None


def _waited_in_vain(process: subprocess.Popen[bytes], written: int, seconds: float) -> bool:
    """Wait for a child; return whether it was ended because it wrote nothing for `seconds`."""
    size, since, hung = 0, time.monotonic(), False
    try:
        while not hung:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=GLANCE)
                return False
            if (now := os.fstat(written).st_size) != size:
                size, since = now, time.monotonic()
            hung = time.monotonic() - since > seconds
    finally:
        if process.poll() is None:
            process.kill()
            # A process whose driver waits for its device does not end on SIGKILL.
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=PARTING)
    return hung


def _reports(text: str) -> list[dict[str, Any]]:
    """Return the reports of a child, one per line; lines of a driver between them are ignored."""
    reports = []
    for line in text.splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            report = json.loads(line)
            if isinstance(report, dict) and set(report) == {"name", "why"}:
                reports.append(report)
    return reports
