"""The issue on the smallest scene: its JSON, a table of the failing pixel's values, and a picture."""

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
from rayproof.reports.shrinking.failure import Renderer, SceneFailure
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.protocol import hand_over

WIDE, HIGH, GAP = 128, 96, 4  # px: width and height of a picture's halves, and the gap between them
VIEWS = (60.0, 30.0, 12.0, 5.0, 2.0, 0.7, 0.2)  # degrees; the first angle that shows enough of the scene is taken
ENOUGH = 0.05  # share of the pixels that must show a shape
SHORT = 700  # characters; a longer scene is not shown in the issue
SECONDS = 120.0  # time limit of one render or one judgement
MARK = 5  # px from the failing pixel to the frame around it


@dataclass(frozen=True, kw_only=True)
class ChannelBounds:
    """One number of the failing pixel: the subject's value, and the float64 bounds of the exact value."""

    stage: Stage
    name: str
    got: float
    low: float
    high: float

    @property
    def right(self) -> str:
        """Return the right value as text: a number, or its two bounds."""
        near = math.isclose(self.low, self.high, rel_tol=1e-9, abs_tol=0.0) or self.low == self.high
        return f"{self.high:.9g}" if near else f"{self.low:.9g} to {self.high:.9g}"


@dataclass(frozen=True, kw_only=True)
class Report:
    """The facts about the smallest scene."""

    scene: Scene
    failure: SceneFailure
    renderer: str  # the subject as the user named it
    command: str  # the command that reproduces the failure in the folder of the report
    panel: str = ""  # a sentence with the verdict of all references together

    @property
    def pixel(self) -> tuple[int, int]:
        """Return the (column, row) of the worst failing pixel; (0, 0) for the camera, or if no single pixel fails."""
        return (self.failure.pixels or ((0, 0),))[0]

    @cached_property
    def channels(self) -> list[ChannelBounds]:
        """Return the subject's values and the certified bounds of the failing pixel, for every stage."""
        from rayproof.reference.certified import Certified  # without the registry, which would load all references

        stages = [stage for stage in stages_of(self.scene) if stage in IMAGE_STAGES]
        (record,) = Certified().enclose(self.scene, stages, [self.pixel])
        column, row = self.pixel
        channels = []
        for stage in stages:
            names = exr_channels(stage, lights=len(self.scene.lights))
            bounds = record["stages"][stage.value]
            images = self.failure.answers
            got = images[stage][row, column] if stage in images else [math.nan] * len(names)
            channels += [
                ChannelBounds(stage=stage, name=name, got=float(value), low=float(low), high=float(high))
                for name, value, (low, high) in zip(names, got, bounds, strict=True)
            ]
        return channels

    def write(self, folder: Path, render: Renderer) -> None:
        """Write scene.json, its meshes, pixel.json, pixel.md, picture.png and issue.md; for a wrong hit vector.csv."""
        hand_over(self.scene, folder)
        table = {
            channel.name: {"got": channel.got, "low": channel.low, "high": channel.high} for channel in self.channels
        }
        about = {"pixel": self.pixel, "stage": self.failure.stage.value, "way": self.failure.way.value}
        blamed = [item for item in TITLES if item in self.failure.items]
        content = {**about, "limit": self.failure.limit, "blamed": blamed, "channels": table}
        (folder / "vector.csv").unlink(missing_ok=True)  # from an earlier scene
        if (vector := vector_of(self.scene, self.failure, self.pixel)) is not None:
            (folder / "vector.csv").write_text(vector, encoding="utf-8")
        (folder / "pixel.json").write_text(as_json(content, indent=1) + "\n", encoding="utf-8")
        (folder / "pixel.md").write_text("\n".join(_table(self.channels)) + "\n", encoding="utf-8")
        _write_picture(folder / "picture.png", self.scene, self.failure.stage, render)
        self.write_issue(folder)

    def write_issue(self, folder: Path) -> None:
        """Write issue.md; it is written again after all references have judged the scene."""
        (folder / "issue.md").write_text("\n".join(self.lines()) + "\n", encoding="utf-8")

    def lines(self) -> Iterator[str]:
        """Yield issue.md, line by line."""
        stage, way, (column, row) = self.failure.stage, self.failure.way, self.pixel
        yield f"# {way.capitalize()} at {stage}: {in_words(self.scene)}"
        yield ""
        yield f"{self.renderer} answers pixel ({column}, {row}) of scene.json wrongly: {self.failure.reason}."
        yield ""
        of_stage = [channel for channel in self.channels if channel.stage is stage]
        wrong = [channel for channel in of_stage if not channel.low <= channel.got <= channel.high] or of_stage
        yield from _table(wrong[:1] if stage is Stage.OBJECT else wrong)  # the face of a wrong shape has no meaning
        yield ""
        blamed = [f"{item} ({TITLES[item]})" for item in TITLES if item in self.failure.items]
        yield f"What is expected is certified. May be to blame: {', '.join(blamed)}. {self.panel}".rstrip()
        yield f"To see it again: `{self.command}`{self._scene()}"

    def _scene(self) -> str:
        """Return a clause with the scene's JSON; an empty string if it is too long."""
        text = as_json(scene_to_json(self.scene)).replace(".0,", ",").replace(".0]", "]").replace(".0}", "}")
        return f", where scene.json is `{text}`" if len(text) <= SHORT else ""


def vector_of(scene: Scene, failure: SceneFailure, pixel: tuple[int, int]) -> str | None:
    """Return a test vector as CSV, header and row, of the ray and the shape in object space; None for other failures.

    A vector needs a scene with a single shape, which is no mesh, and a wrong object or distance. The ray is rounded to
    float32. A triangle is in world space, to which its corners are transformed.
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
    """Return whether all references together find the subject wrong in a scene file, and a sentence with the verdict.

    `configuration` is the tracer's, unused for another subject. References render in worker processes, since some
    of them may crash.
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
    answered = {check.reference for check in checks if check.outcome not in ("unsupported", "undecided")}
    blaming = {check.reference for check in checks if check.outcome == Outcome.FAIL}
    where = f" at {case['stage']}" if case.get("stage") else ""
    against = f": {case.get('reason') or ''}"
    if blaming:
        against = f"; {len(blaming)} of {len(answered)} references differ from it"
    return case["verdict"] == Outcome.FAIL.value, f"All references together: {case['verdict']}{where}{against}."


def _table(channels: Sequence[ChannelBounds]) -> Iterator[str]:
    yield "| | got | expected |"
    yield "|---|---|---|"
    for entry in channels:
        yield f"| {entry.name} | {'not written' if math.isnan(entry.got) else f'{entry.got:.9g}'} | {entry.right} |"


def in_words(scene: Scene) -> str:
    """Return the content of a scene as a phrase: numbers of shapes by kind, of lights and of pixels."""
    kinds = Counter(NAMES[type(shape)] for shape in scene.shapes)
    faces = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
    parts = [several(count, kind) for kind, count in kinds.items()] or ["no shape"]
    parts += [several(faces, "face")] if faces else []
    parts += [several(len(scene.lights), "light") if scene.lights else "no light"]
    return f"{', '.join(parts)}, {scene.camera.width} x {scene.camera.height} px"


def _write_picture(file: Path, scene: Scene, stage: Stage, render: Renderer) -> None:
    """Draw the failing stage in a wider view, the subject's on the left and the right one on the right.

    A frame marks the failing pixel.
    """
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
    """Return the scene with a wider view around the failing pixel that shows enough of its shapes.

    If the image has more than one pixel, keep its view.
    """
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
