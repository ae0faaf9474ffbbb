"""A PyVista picture of every case's scene and its 3-D view, all made in child processes that may die without harm.

Pictures need OpenGL; views do not, and are made without, too.
"""

import os
import re
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path, PurePosixPath

from rayproof.reports.cache import pictures
from rayproof.reports.cache.pictures import PictureJob
from rayproof.reports.cache.store import Store
from rayproof.reports.publish.scene3d import gl
from rayproof.reports.publish.scene3d.drawing_child import DrawingChild
from rayproof.reports.results.case_table import amend, amending, named
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.images import inside
from rayproof.reports.results.records import CaseRecord, RunRecord

PICTURE, VIEW = ".png", ".view.js"
OURS, THEIRS = "tracer-float32", "analytic"
# A second process takes a second and a third of a gigabyte to begin with; where this many cases wait, it pays.
BACKLOG = 16
MOST = min(4, os.cpu_count() or 1)  # processes
ALL_OF = 1000  # cases of a run that are all drawn, as they come; a picture takes a fifth of a second
WORST = 100  # cases of a longer run that are drawn when they are all known
PATIENCE = 120.0  # s for one picture, where nobody says how long it may take


def drawn_usually(cases: Sequence[CaseRecord]) -> Sequence[CaseRecord]:
    """Return the cases of a run that are drawn if nobody asks for others: all, of a long run the worst."""
    return cases if len(cases) <= ALL_OF else worst_first(cases)[:WORST]


def chosen(cases: Sequence[CaseRecord], which: str) -> Sequence[CaseRecord]:
    """Return the cases that `which` names: `all`, `worst:N`, or one by its name.

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


def draw_pictures(folder: Path, results: RunRecord, progress: Callable[[str], None] | None = None) -> str | None:
    """Draw DIR/pictures/<case>.png and write its view for each case; return why any pictures were left out, or None.

    `progress` is told the name of each case drawn. `results` is changed in place (`picture` and `view` of each case);
    the caller writes it.
    """
    with Drawing(folder, progress) as drawing:
        for case in results["cases"]:
            drawing.submit(case)
    drawing.tell(results["cases"])
    return drawing.reason


class Drawing:
    """Pictures and views made in child processes while other work goes on: submit cases, leave the block, ask why.

    Whether the machine can draw is asked when the block is entered: the answer takes seconds, the first time, and only
    the end of the block waits for it. A child starts with the first case that can be drawn, another where cases wait
    for it. What `store` has of the very same images is taken from there. One picture may take `seconds`.
    """

    def __init__(
        self,
        folder: Path,
        progress: Callable[[str], None] | None = None,
        *,
        store: Store | None = None,
        seconds: float = PATIENCE,
    ) -> None:
        self.reason: str | None = None  # why pictures were left out; complete when the block is left
        self._folder, self._progress, self._store, self._seconds = folder, progress, store, seconds
        self._held: list[tuple[str, PictureJob]] = []  # cases' names and jobs, until it is known who draws
        self._jobs: dict[str, tuple[str, PictureJob]] = {}  # what is to be kept when it is drawn, and its question
        self._cases: dict[str, str | None] = {}  # those that a child draws: where the view goes
        self._found: dict[str, dict[str, str | None]] = {}
        self._drawn = 0
        self._pictures = True  # whether the machine can draw
        self._asked: Future[str | None] | None = None
        self._failures: list[str] = []
        self._children: list[DrawingChild] = []
        self._one_at_a_time = threading.Lock()  # children answer whenever they like

    def __enter__(self) -> "Drawing":
        self._asked = gl.ask()
        return self

    def submit(self, case: CaseRecord) -> None:
        """Have a case drawn; `tell` says where its `picture` and `view` are, which the record has not before."""
        self.leave_out(case)
        job = _job(self._folder, case)
        if job is not None:
            self._held.append((case["name"], job))
            self._release(wait=False)

    @staticmethod
    def leave_out(case: CaseRecord) -> None:
        """Say in the record of a case that it has no picture and no view."""
        case["picture"] = case["view"] = None

    def tell(self, cases: Sequence[CaseRecord]) -> None:
        """Write into the records of a run where pictures and views of its cases are, as far as they were made."""
        with amending(cases):
            for name, paths in self._found.items():
                case = named(cases, name)
                if case is not None:
                    amend(cases, case, **paths)

    @property
    def count(self) -> int:
        """Return how many cases were drawn, or found drawn before."""
        return len(self._found)

    @property
    def pending(self) -> bool:
        """Say whether the end of the block has anything to wait for."""
        return bool(self._held) or any(child.waiting for child in self._children)

    def _release(self, *, wait: bool) -> None:
        """Draw what is held, once it is known whether the machine can."""
        if self._held and self._asked is not None and (wait or self._asked.done()):
            self.reason, self._asked = self._asked.result(), None
            self._pictures = self.reason is None
        if self._asked is None:
            held, self._held = self._held, []
            for name, job in held:
                self._draw(name, job)

    def _draw(self, name: str, job: PictureJob) -> None:
        if not self._pictures:
            job["picture"] = None
        if self._store is not None:
            key = pictures.question(job)
            if pictures.recall(self._store, key, job):
                self._set(name, job["view"])
                return
            self._jobs[name] = (key, job)
        self._cases[name] = job["view"]
        self._child().submit(job)

    def _child(self) -> DrawingChild:
        """Return who has least to draw, or one more; where one died, who is left."""
        alive = [child for child in self._children if child.alive]
        # No other begins where all died: what killed them would kill it.
        idlest = min(alive or self._children, key=lambda child: child.waiting, default=None)
        if idlest is None or (alive and idlest.waiting >= BACKLOG and len(self._children) < MOST):
            environment = gl.drawing_environment() if self._pictures else gl.recording_environment()
            idlest = DrawingChild(environment, seconds=self._seconds, drawn=self._is_drawn, failed=self._failed)
            self._children.append(idlest)
        return idlest

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._release(wait=True)
        ends = [child.close(kill=kind is not None) for child in self._children]
        self.reason = self._conclude([end for end in ends if end is not None]) or self.reason

    def _is_drawn(self, name: str) -> None:
        with self._one_at_a_time:
            self._drawn += 1
            self._set(name, self._cases[name])
            if self._store is not None:
                pictures.keep(self._store, *self._jobs.pop(name))

    def _failed(self, name: str, why: str) -> None:
        with self._one_at_a_time:
            self._failures.append(f"{name}: {why}")

    def _set(self, name: str, view: str | None) -> None:
        """Note of a case where its view is, and its picture beside it."""
        picture = f"{(view or '').removesuffix(VIEW)}{PICTURE}" if self._pictures else None
        self._found[name] = {"picture": picture, "view": view}
        if self._progress is not None:
            self._progress(name)

    def _conclude(self, ends: list[str]) -> str | None:
        """Return why pictures were left out, given where and how children ended that did not end well."""
        total = len(self._cases)
        if ends:
            return f"drawing ended at {', '.join(ends)}; {self._drawn} of {total} drawn"
        if self._failures:
            more = f" and {len(self._failures) - 1} more" if len(self._failures) > 1 else ""
            return f"{self._drawn} of {total} drawn; {self._failures[0]}{more}"
        return None


def picture_path(case: CaseRecord) -> str | None:
    """Return where a case's picture goes below the results folder: named as the run named its scene, or None."""
    return _beside(case, PICTURE)


def view_path(case: CaseRecord) -> str | None:
    """Return where a case's 3-D view goes below the results folder, or None."""
    return _beside(case, VIEW)


def _beside(case: CaseRecord, suffix: str) -> str | None:
    parts = PurePosixPath(case.get("scene") or "").parts
    if len(parts) < 2 or parts[0] != "scenes" or ".." in parts:
        return None
    return PurePosixPath("pictures", *parts[1:]).with_suffix(suffix).as_posix()


def _job(folder: Path, case: CaseRecord) -> PictureJob | None:
    """Return what the child must know to draw a case, or None if the run kept no scene of it."""
    scene = case.get("scene")
    if not scene or not inside(folder, scene) or picture_path(case) is None:
        return None
    ours, theirs = _compared(case)
    return {
        "name": case["name"],
        "scene": str((folder / scene).resolve()),
        "folder": str(folder.resolve()),
        "case": {"renders": case.get("renders"), "pixels": case.get("pixels")},
        "ours": ours,
        "theirs": theirs,
        "stage": case.get("stage"),
        "picture": str((folder / str(picture_path(case))).resolve()),
        "view": view_path(case),
    }


def _compared(case: CaseRecord) -> tuple[str | None, str | None]:
    """Return whose answers are drawn: the tracer's, or whatever else was put under test, and a reference's."""
    names = [str(render.get("renderer")) for render in case.get("renders", [])]
    ours = OURS if OURS in names else next(iter(names), None)
    others = [name for name in names if name != ours and not name.startswith("tracer-")]
    return ours, THEIRS if THEIRS in others else next(iter(others), None)
