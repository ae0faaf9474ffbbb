"""The issue about the smallest scene: its JSON, a table of its pixel by stages, a picture."""

import contextlib
import math
import os
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Sphere, Triangle
from rayproof.cases.scene_json import NAMES, scene_to_json
from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.document import load_results
from rayproof.reports.results.files import as_json, several
from rayproof.reports.results.outcomes import TITLES, Outcome
from rayproof.reports.shrinking.failure import Failure, Renderer
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.protocol import hand_over

WIDE, HIGH, GAP = 128, 96, 4  # px of a picture's halves, and between them
VIEWS = (60.0, 30.0, 12.0, 5.0, 2.0, 0.7, 0.2)  # degrees: the first that shows enough of the scene is taken
ENOUGH = 0.05  # of the pixels
SHORT = 700  # characters of a scene that is shown in a line
SECONDS = 120.0  # for one render or one judgement by the references
MARK = 5  # px from the middle to the frame round the failing pixel


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One number of the failing pixel: what the subject says, and two float64 numbers between which the answer lies."""

    stage: Stage
    name: str
    got: float
    low: float
    high: float

    @property
    def right(self) -> str:
        """Return the answer in words: a number, or between which it lies."""
        near = math.isclose(self.low, self.high, rel_tol=1e-9, abs_tol=0.0) or self.low == self.high
        return f"{self.high:.9g}" if near else f"{self.low:.9g} to {self.high:.9g}"


@dataclass(frozen=True, kw_only=True)
class Report:
    """The facts about the smallest scene."""

    scene: Scene
    failure: Failure
    renderer: str  # what is wrong, in the words of its user
    command: str  # that shows it again, in the folder of the report
    panel: str = ""  # what all references together say, in a sentence

    @property
    def pixel(self) -> tuple[int, int]:
        """Return the failing pixel; of a camera, or of what only many pixels show, the first."""
        return (self.failure.pixels or ((0, 0),))[0]

    @cached_property
    def channels(self) -> list[Channel]:
        """Return the failing pixel, stage by stage, by the subject and by certified bounds."""
        from rayproof.reference.certified import Certified  # not by the registry, which would load every other first

        stages = [stage for stage in stages_of(self.scene) if stage in IMAGE_STAGES]
        (record,) = Certified().enclose(self.scene, stages, [self.pixel])
        column, row = self.pixel
        found = []
        for stage in stages:
            names = exr_channels(stage, lights=len(self.scene.lights))
            bounds = record["stages"][stage.value]
            images = self.failure.answers
            got = images[stage][row, column] if stage in images else [math.nan] * len(names)
            found += [
                Channel(stage=stage, name=name, got=float(value), low=float(low), high=float(high))
                for name, value, (low, high) in zip(names, got, bounds, strict=True)
            ]
        return found

    def write(self, folder: Path, render: Renderer) -> None:
        """Write scene.json, its meshes, pixel.json, pixel.md, picture.png, issue.md; of a wrong hit vector.csv."""
        hand_over(self.scene, folder)
        table = {one.name: {"got": one.got, "low": one.low, "high": one.high} for one in self.channels}
        about = {"pixel": self.pixel, "stage": self.failure.stage.value, "way": self.failure.way.value}
        blamed = [item for item in TITLES if item in self.failure.items]
        content = {**about, "limit": self.failure.limit, "blamed": blamed, "channels": table}
        (folder / "vector.csv").unlink(missing_ok=True)  # of an earlier scene
        if (vector := vector_of(self.scene, self.failure, self.pixel)) is not None:
            (folder / "vector.csv").write_text(vector, encoding="utf-8")
        (folder / "pixel.json").write_text(as_json(content, indent=1) + "\n", encoding="utf-8")
        (folder / "pixel.md").write_text("\n".join(_table(self.channels)) + "\n", encoding="utf-8")
        _write_picture(folder / "picture.png", self.scene, self.failure.stage, render)
        self.write_issue(folder)

    def write_issue(self, folder: Path) -> None:
        """Write issue.md, which can be written again once the panel has spoken."""
        (folder / "issue.md").write_text("\n".join(self.lines()) + "\n", encoding="utf-8")

    def lines(self) -> Iterator[str]:
        """Yield issue.md, line by line."""
        stage, way, (column, row) = self.failure.stage, self.failure.way, self.pixel
        yield f"# {way.capitalize()} at {stage}: {in_words(self.scene)}"
        yield ""
        yield f"{self.renderer} answers pixel ({column}, {row}) of scene.json wrongly: {self.failure.reason}."
        yield ""
        there = [one for one in self.channels if one.stage is stage]
        wrong = [one for one in there if not one.low <= one.got <= one.high] or there
        yield from _table(wrong[:1] if stage is Stage.OBJECT else wrong)  # of a wrong object its face says nothing
        yield ""
        blamed = [f"{item} ({TITLES[item]})" for item in TITLES if item in self.failure.items]
        yield f"What is expected is certified. May be to blame: {', '.join(blamed)}. {self.panel}".rstrip()
        yield f"To see it again: `{self.command}`{self._scene()}"

    def _scene(self) -> str:
        """Return the scene itself, if it is short enough to be read in a line."""
        text = as_json(scene_to_json(self.scene)).replace(".0,", ",").replace(".0]", "]").replace(".0}", "}")
        return f", where scene.json is `{text}`" if len(text) <= SHORT else ""


def vector_of(scene: Scene, failure: Failure, pixel: tuple[int, int]) -> str | None:
    """Return ray and shape in object space as a test vector, header and row; None where no single shape is hit wrongly.

    The ray is float32's nearest to the exact one; a triangle stands in the world, where it is baked.
    """
    if failure.stage not in (Stage.OBJECT, Stage.DISTANCE) or len(scene.shapes) != 1:
        return None
    from rayproof.reports.vectors import Row
    from rayproof.reports.vectors.check import VERSION
    from rayproof.reports.vectors.files import ORDER, as_csv, cells, columns
    from rayproof.reports.vectors.rows import QUESTIONS

    (shape,), (column, row) = scene.shapes, pixel
    if isinstance(shape, Mesh):
        return None
    back = np.eye(4) if isinstance(shape, Triangle) else np.linalg.inv(np.asarray(shape.to_world, dtype=np.float64))
    origin = (back @ (*scene.camera.eye, 1.0))[:3]
    direction = back[:3, :3] @ np.asarray(failure.truth[Stage.RAY][row, column], dtype=np.float64)
    inputs: dict[str, Any] = {"o": _single(origin), "d": _single(direction)}
    if isinstance(shape, Triangle):
        inputs |= {name: _single(corner) for name, corner in zip("abc", world_triangles(shape)[0], strict=True)}
    elif isinstance(shape, Sphere):
        inputs |= {"center": _single(shape.center), "radius": float(np.float32(shape.radius))}
    elif isinstance(shape, Cube):
        inputs |= {"min": (-0.5, -0.5, -0.5), "max": (0.5, 0.5, 0.5)}
    elif isinstance(shape, Plane):
        inputs |= {"point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    else:
        inputs |= {"center": (0.0, 0.0, 0.0), "half_width": (0.5, 0.0, 0.0), "half_height": (0.0, 0.5, 0.0)}
    file = "box" if isinstance(shape, Cube) else NAMES[type(shape)]
    answer, item = QUESTIONS[file, "distance"]
    space = "world" if isinstance(shape, Triangle) else "object"
    sided = "" if isinstance(shape, Sphere | Cube) else "two"
    vector = Row(
        file=file,
        question="distance",
        kind="reported",
        item=item,
        inputs=inputs,
        exact=answer(inputs),
        why=failure.reason,
        space=space,
        sided=sided,
    )
    table = [cells(f"{VERSION}-{file}-shrunk", vector)]
    return as_csv(columns(table, ORDER), table)


def _single(numbers: Any) -> tuple[float, ...]:
    return tuple(np.asarray(numbers, dtype=np.float32).astype(np.float64).tolist())


def judged_by_all(scene_file: Path, subject: Subject, configuration: str) -> tuple[bool, str]:
    """Return whether all references together blame the subject in a scene file, and a sentence about it.

    `configuration` is the tracer's, unused for another subject. References render in worker processes, since some
    of them may end their process.
    """
    from rayproof.reports.run.options import RunOptions
    from rayproof.reports.run.suite import run

    with tempfile.TemporaryDirectory(prefix="rayproof-issue-") as folder, Path(os.devnull).open("w") as nothing:
        request = RunOptions(
            selectors=(str(scene_file),),
            out=Path(folder),
            resume=False,
            require=(),
            jobs=os.cpu_count() or 1,
            timeout=SECONDS,
            configurations=(configuration,) if subject.is_tracer else (),
            json=None,
            subject=subject,
            diagnose=False,
        )
        with contextlib.redirect_stdout(nothing), contextlib.redirect_stderr(nothing):
            run(request)
        (case,) = load_results(Path(folder))["cases"]
    checks = case["checks"]
    answered = {check["reference"] for check in checks if check["verdict"] not in ("unsupported", "undecided")}
    blaming = {check["reference"] for check in checks if check["verdict"] == Outcome.FAIL.value}
    where = f" at {case['stage']}" if case.get("stage") else ""
    against = f": {case.get('reason') or ''}"
    if blaming:
        against = f"; {len(blaming)} of {len(answered)} references differ from it"
    return case["verdict"] == Outcome.FAIL.value, f"All references together: {case['verdict']}{where}{against}."


def _table(channels: Sequence[Channel]) -> Iterator[str]:
    yield "| | got | expected |"
    yield "|---|---|---|"
    for one in channels:
        yield f"| {one.name} | {'not written' if math.isnan(one.got) else f'{one.got:.9g}'} | {one.right} |"


def in_words(scene: Scene) -> str:
    """Return how much there is of a scene: shapes by kind, lights, pixels."""
    kinds = Counter(NAMES[type(shape)] for shape in scene.shapes)
    faces = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
    parts = [several(count, kind) for kind, count in kinds.items()] or ["no shape"]
    parts += [several(faces, "face")] if faces else []
    parts += [several(len(scene.lights), "light") if scene.lights else "no light"]
    return f"{', '.join(parts)}, {scene.camera.width} x {scene.camera.height} px"


def _write_picture(file: Path, scene: Scene, stage: Stage, render: Renderer) -> None:
    """Draw the failing stage by the subject, left, and rightly, in a wider view; the failing pixel is framed."""
    from matplotlib.image import imsave

    drawn = stage if stage in IMAGE_STAGES else Stage.RAY
    wide = _wider(scene)
    right = Analytic().render(wide, stages_of(wide))
    images = [right[drawn]]
    try:
        answers: Mapping[Stage, np.ndarray] = render(wide).answers or {}
    except ValueError:
        answers = {}
    if drawn in answers and answers[drawn].shape == right[drawn].shape:
        images.insert(0, answers[drawn])
    finite = np.concatenate([image[np.isfinite(image)] for image in images])
    low, high = (float(finite.min(initial=0.0)), float(finite.max(initial=0.0))) if len(finite) else (0.0, 1.0)
    panels = [_panel(image, low, high if high > low else low + 1.0) for image in images]
    gap = np.ones((HIGH, GAP, 3))
    imsave(file, np.concatenate([part for panel in panels for part in (gap, panel)][1:], axis=1), format="png")


def _wider(scene: Scene) -> Scene:
    """Return the scene in a wider view that shows enough of its shapes round the middle; of a larger image, its own."""
    camera = replace(scene.camera, width=WIDE, height=HIGH)
    if scene.camera.width * scene.camera.height > 1:
        return replace(scene, camera=camera)
    for fovy in VIEWS:
        wide = replace(scene, camera=replace(camera, fovy=fovy))
        if np.mean(Analytic().render(wide, (Stage.OBJECT,))[Stage.OBJECT][..., 0] >= 0) >= ENOUGH:
            return wide
    return replace(scene, camera=replace(camera, fovy=VIEWS[0]))


def _panel(image: np.ndarray, low: float, high: float) -> np.ndarray:
    three = image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, axis=-1)
    with np.errstate(invalid="ignore", over="ignore"):
        shown = np.clip(np.nan_to_num((three - low) / (high - low), posinf=0.0, neginf=0.0), 0, 1)
    row, column = HIGH // 2, WIDE // 2
    frame = np.s_[row - MARK : row + MARK + 1, column - MARK : column + MARK + 1]
    inside = np.s_[row - MARK + 1 : row + MARK, column - MARK + 1 : column + MARK]
    kept = shown[inside].copy()
    shown[frame], shown[inside] = (1.0, 0.2, 0.2), kept
    return shown
