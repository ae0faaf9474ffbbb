"""The journal's guard: a finished case is taken up again under exactly its own key, which every change changes."""

import tempfile
from dataclasses import replace
from pathlib import Path

from cases.case import Case
from cases.scene import Camera, PointLight, Scene, Sphere
from reports.run import plan
from reports.run.guards import BrokenHarnessError
from reports.run.journal import Journal
from reports.run.plan import PlannedCase

_CAMERA = Camera(
    eye=(0.0, -3.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), fovy=40.0, width=4, height=3, near=0.1, far=9.0
)
_SCENE = Scene(camera=_CAMERA, shapes=(Sphere(albedo=(0.5, 0.5, 0.5)),))
_CASE = Case(
    name="guard/journal", scene=_SCENE, stresses="Nothing.", covers=("HIT-1",), least_interior=0, most_edge=0.5
)
_PLANNED = PlannedCase(case=_CASE, configurations=("float32",))
_REFERENCES = ("analytic",)


def guard_journal() -> None:
    """Ask for keys and for records whose answers are known; raise BrokenHarnessError where one is another."""
    known = plan.key(_PLANNED, _REFERENCES)
    moved = replace(_SCENE, shapes=(Sphere(albedo=(0.5, 0.5, 0.5), radius=1.0000001),))
    lit = replace(_SCENE, lights=(PointLight(position=(1.0, 1.0, 1.0), flux=(1.0, 1.0, 1.0)),))
    others = {
        "a shape": plan.key(replace(_PLANNED, case=replace(_CASE, scene=moved)), _REFERENCES),
        "a light": plan.key(replace(_PLANNED, case=replace(_CASE, scene=lit)), _REFERENCES),
        "a demand": plan.key(replace(_PLANNED, case=replace(_CASE, least_interior=1)), _REFERENCES),
        "a configuration": plan.key(replace(_PLANNED, configurations=("float64",)), _REFERENCES),
        "a reference": plan.key(_PLANNED, (*_REFERENCES, "another")),
        "the code": plan.question(_PLANNED, _REFERENCES, "of other code"),
    }
    for what, key in others.items():
        if key == known:
            raise BrokenHarnessError(f"the journal is broken: {what} that changed leaves a case's key as it was")
    # As long as any digest: without the code there is none.
    if len(plan.code_digest()) != len(known) or plan.question(_PLANNED, _REFERENCES, plan.code_digest()) != known:
        raise BrokenHarnessError("the journal is broken: the key does not hold the code's digest")
    with tempfile.TemporaryDirectory() as folder:
        _guard_records(Path(folder), known, others["a shape"])


def _guard_records(folder: Path, known: str, other: str) -> None:
    """Write one record and ask for it by the right key and by a wrong one."""
    with Journal(folder, resume=False) as journal:
        journal.append(known, {"name": _CASE.name})
    with Journal(folder, resume=True) as journal:
        if journal.finished(known) != {"name": _CASE.name}:
            raise BrokenHarnessError("the journal is broken: a finished case was forgotten")
        if journal.finished(other) is not None:
            raise BrokenHarnessError("the journal is broken: a case was taken up again under another key")
    with Journal(folder, resume=False) as journal:
        if journal.finished(known) is not None:
            raise BrokenHarnessError("the journal is broken: a case was taken up again without being asked to")
