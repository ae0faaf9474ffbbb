"""The keys' guard: whatever an answer depends on is changed, one field after another, and must make another key.

The fields are those that the classes declare (of the keys themselves; of the case, its scene and all that is in it; of
the answers put to the test; of a run's request), so that a new one is changed too, or the guard cries for a way to.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from rayproof import ROOT
from rayproof.cases.case import Case, PixelValue
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import Resolution, Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.run import plan, reference_cache, verdict_memory
from rayproof.reports.run.options import CaseOptions, RunOptions, case_options
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.reference_cache import Key
from rayproof.reports.subjects import Subject
from tests.harness.guards import BrokenHarnessError

_CORNERS = ((0.0, 0.0, 0.5), (1.0, 0.0, 0.5), (0.0, 1.0, 0.5))
_ALBEDO = (0.5, 0.25, 0.75)
SCENE = Scene(
    camera=Camera(
        eye=(0.0, -3.0, 0.5),
        target=(0.0, 0.0, 0.0),
        up=(0.0, 0.0, 1.0),
        fovy=40.0,
        width=4,
        height=3,
        near=0.1,
        far=9.0,
    ),
    shapes=(
        Sphere(albedo=_ALBEDO),
        Cube(albedo=_ALBEDO),
        Square(albedo=_ALBEDO),
        Plane(albedo=_ALBEDO),
        Triangle(albedo=_ALBEDO, vertices=_CORNERS),
        Mesh(albedo=_ALBEDO, vertices=np.array(_CORNERS), faces=np.array(((0, 1, 2),))),
    ),
    lights=(PointLight(position=(1.0, 2.0, 3.0), flux=(4.0, 5.0, 6.0)),),
)
CASE = Case(
    name="guard/keys",
    scene=SCENE,
    stresses="Nothing.",
    covers=("HIT-1",),
    least_interior=0,
    most_explained=0.5,
    expectations=(
        PixelValue(stage=Stage.RAY, column=0, row=0, channel=0, value=0.5, relative=0.5, because="a guard says so"),
    ),
)
_IMAGE = np.linspace(0.1, 1, 36, dtype=np.float32).reshape(3, 4, 3)
OURS = Answers(
    name="guard",
    precision="float32",
    items=frozenset({"HIT-1"}),
    shadow_epsilon=1e-6,
    answers={Stage.CAMERA: {"view": np.eye(4)}, Stage.RADIANCE: _IMAGE},
    resolutions={Stage.RADIANCE: Resolution(relative=0.5, absolute=0.5, because="a guard says so")},
)
VERSIONS = {"analytic": "1"}
REQUEST = RunOptions(
    selectors=(), out=Path("out"), resume=True, require=(), jobs=1, timeout=60.0, configurations=(), json=None
)
# Which cases, how a run goes about them, where to: none of it is part of what is found of a case. Configurations are
# each a candidate of their own, by name and answers.
HOW = (
    "selectors",
    "scenes",
    "worker_memory",
    "shard",
    "out",
    "resume",
    "jobs",
    "timeout",
    "json",
    "cached",
    "history",
    "demanded",
    "configurations",
    "patient",
    "diagnose",
    "least_coverage",
)
# Of a case's options: the cache, the patience, and the files on another machine.
WAY = ("cached", "patient", "sources", "copies")
# The title of a subject tells its name and transport. Its identity tells its command, what it declares and what it can
# do. Limits of time and memory change no answer.
TOLD_BY_IDENTITY = ("name", "transport", "command", "capabilities", "declare", "variables", "seconds", "memory")
# Other values of what cannot be guessed from the value that is there.
OTHERS: Mapping[tuple[str, str], Any] = {
    ("Scene", "shading"): "simplified",
    ("Scene", "clip"): "shell",
    ("Triangle", "vertices"): (*_CORNERS[:2], (0.0, 1.0, float(np.nextafter(np.float32(0.5), np.float32(1))))),
    ("Mesh", "file"): "mesh.obj",
    ("Case", "stresses"): "Nothing else.",
    ("Case", "covers"): ("HIT-2",),
    ("Answers", "error"): "it fell",
    ("Answers", "fine"): {Stage.RADIANCE: _IMAGE},
    ("Answers", "mean"): _IMAGE,
    ("Answers", "unsupported"): {Stage.NORMAL: "a guard says so"},
    ("Answers", "lacking"): {Stage.NORMAL: "a guard says so"},
    ("Answers", "notes"): ("a guard says so",),
    ("Answers", "mishaps"): ("a guard says so",),
    ("Answers", "settings"): {"quality": "2"},
    ("RunOptions", "require"): ("analytic",),
    ("Subject", "identity"): ("another program",),
    ("CaseOptions", "require"): ("analytic",),
    ("CaseOptions", "own"): ("sphere=mine.py:nearest_hit 0",),
    ("JudgementKey", "notes"): ("it says so",),
    ("Resolution", "steps"): np.full(_IMAGE.shape, 0.25),
    ("RenderKey", "settings"): {"quality": "2"},
}


def guard_keys() -> None:
    """Change whatever an answer depends on; raise BrokenHarnessError where the key stays as it was."""
    asked = case_options(REQUEST, ("analytic",))
    planned = PlannedCase(case=CASE, configurations=("float32",))
    for what, build, told in (
        ("a verdict of a case", lambda case: _judgement(case, OURS, asked), CASE),
        ("a verdict of answers", lambda ours: _judgement(CASE, ours, asked), OURS),
        ("a verdict before references", lambda versions: _judgement(CASE, OURS, asked, versions), VERSIONS),
        ("a record", lambda one: plan.record_key(one, asked), planned),
        ("a render", _render, SCENE),
    ):
        _guard_changes(what, build, told, ())
    _guard_changes("a record's options", lambda one: plan.record_key(planned, one), asked, WAY)
    _guard_changes("a verdict's options", lambda one: _judgement(CASE, OURS, one), asked, WAY)
    _guard_changes("what a run demands", _of_run, REQUEST, HOW)
    _guard_declared(planned, asked)
    _guard_code()


def _guard_declared(planned: PlannedCase, asked: CaseOptions) -> None:
    """Change each field of each kind of key there is."""
    samples: dict[type[Key], Key] = {
        type(key): key
        for key in (
            _judgement(CASE, OURS, asked),
            _render(SCENE),
            plan.record_key(planned, asked),
            verdict_memory.GuardKey(name="guard", code="0", machine=("numpy 1",)),
        )
    }
    for kind in Key.__subclasses__():
        if kind not in samples:
            raise BrokenHarnessError(f"the keys are broken: nobody changes the fields of {kind.__name__}")
        _guard_changes(kind.__name__, lambda key: key, samples[kind], ())
    for key in samples.values():
        if not isinstance(key, verdict_memory.GuardKey) and (len(key.code) < 64 or not key.machine):
            raise BrokenHarnessError(
                f"the keys are broken: {type(key).__name__} does not hold the code and the machine"
            )


def _guard_changes(what: str, build: Callable[[Any], Key], told: Any, inert: tuple[str, ...]) -> None:
    """Build a key of what is `told` and of each change of it, and see that all are different but for `inert` fields."""
    known = build(told).digest
    for path, changed in _changes(told, top=inert):
        if build(changed).digest == known:
            raise BrokenHarnessError(f"the keys are broken: {what} has the same key whatever {path} is")


def _changes(value: Any, *, top: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Yield a name and a changed value for each part of a value; of a dataclass only fields in `top` are left out.

    Raises:
        BrokenHarnessError: nobody knows how to change a field.

    """
    if is_dataclass(value) and not isinstance(value, type):
        kind = type(value).__name__
        inert = TOLD_BY_IDENTITY if isinstance(value, Subject) else top
        for field in fields(value):
            if field.name in inert:
                continue
            count = 0
            for path, part in _parts(kind, field.name, getattr(value, field.name)):
                try:
                    changed = replace(value, **{field.name: part})
                except ValueError:
                    continue  # what a scene or a case refuses no key can hold
                count += 1
                yield f"{kind}.{path}", changed
            if not count:
                raise BrokenHarnessError(f"the keys are broken: nobody knows how to change {kind}.{field.name}")
    else:
        yield from _parts("", "", value)


def _parts(kind: str, name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield changes of one field's value."""
    if (kind, name) in OTHERS:
        yield name, OTHERS[kind, name]
    elif is_dataclass(value):
        yield from ((f"{name}, {path}", part) for path, part in _changes(value))
    elif isinstance(value, np.ndarray):
        changed = value.copy()
        first = changed.flat[0]
        changed.flat[0] = first + 1 if value.dtype.kind in "iu" else np.nextafter(first, first.dtype.type(2))
        yield name, changed
    elif isinstance(value, Mapping):
        for key, item in value.items():
            for path, part in _parts("", f"{name} {key}", item):
                yield path, {**value, key: part}
        for key in value:
            yield f"{name} without {key}", {other: item for other, item in value.items() if other != key}
    elif isinstance(value, tuple):
        for index, item in enumerate(value):
            for path, part in _parts("", f"{name} {index}", item):
                yield path, (*value[:index], part, *value[index + 1 :])
        if value and not isinstance(value[0], float | tuple):
            yield f"{name}'s last", value[:-1]
    elif isinstance(value, frozenset):
        yield name, value | {"another"}
    elif isinstance(value, bool):
        yield name, not value
    elif isinstance(value, Enum):
        yield name, next(other for other in type(value) if other is not value)
    elif isinstance(value, str):
        yield name, f"{value}'"
    elif isinstance(value, int):
        yield name, value + 1
    elif isinstance(value, float):
        yield name, float(np.nextafter(value, np.inf))


def _judgement(case: Case, ours: Answers, asked: CaseOptions, versions: Mapping[str, str] = VERSIONS) -> Key:
    return verdict_memory.judgement_key(case, (ours,), versions, asked, ())


class _Known:
    """A reference of which a key needs no more than its version."""

    precision = "float64"

    def version(self) -> str:
        """Return its version."""
        return "1"


def _render(scene: Scene) -> Key:
    stages = (Stage.RAY, Stage.RADIANCE)
    return reference_cache.Question(name="known", reference=_Known(), scene=scene, stages=stages, samples=1).key  # type: ignore[arg-type]


def _of_run(request: RunOptions) -> Key:
    return plan.record_key(PlannedCase(case=CASE, configurations=("float32",)), case_options(request, ("analytic",)))


def _guard_code() -> None:
    """See that the code of a key is that of all packages that decide an answer."""
    covered = {path.relative_to(ROOT).as_posix() for path in reference_cache.sources(tracer=True)}
    for file in (
        "cases/scene.py",
        "reference/analytic/surfaces.py",
        "reports/judge/findings.json",
        "reports/results/files.py",
        "tracer/render.py",
    ):
        if file not in covered:
            raise BrokenHarnessError(f"the keys are broken: {file} decides an answer and is part of no key")
