"""`rayproof probe`: the values of every stage at one pixel, from every renderer."""

import textwrap
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.commands.lookup import (
    Repeated,
    configurations,
    references_named,
    scene_named,
    subject_named,
)
from rayproof.reports.commands.output import say, shout, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.subjects import Subject
    from rayproof.tracer.configuration import Configuration

WIDTH, NAME, NUMBER, ACROSS = 80, 26, 17, 3  # columns of a line, a renderer's name, a number; numbers in a line
Column = dict[str, float | str]  # row name -> number, or the reason why there is no number


def probe(
    case: str,
    x: int,
    y: int,
    *,
    configuration: Repeated = (),
    formula: Repeated = (),
    require: Repeated = (),
    subject: str = "tracer",
    env: Repeated = (),
    declare: Path | None = None,
    cache: bool = True,
    json: Path | None = None,
) -> int:
    """Show every stage at one pixel as each renderer computes it, and the values of nearby problems if it is wrong.

    For example: rayproof probe primitives/sphere 48 36 --subject radiance

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    x
        The pixel's column; 0 is the leftmost.
    y
        The pixel's row; 0 is the topmost.
    configuration
        A configuration of the tracer, as in `rayproof run`. Repeatable. Default: float32 and float64.
    formula
        A formula for the tracer, such as triangle=signed_areas, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Repeatable.
    require
        A reference that renders only on request, such as certified. Repeatable.
    subject
        Another renderer, whose values are printed first: a reference by name, "exec:COMMAND {scene} {output}",
        "serve:COMMAND" or "python:FILE.py:FUNCTION".
    env
        An environment variable to pass to a program, as in `rayproof run`. Repeatable.
    declare
        A JSON file with properties of a program that it does not declare itself, as in `rayproof run`.
    cache
        Reuse cached renders of references; the tracer always renders.
    json
        Also write the values to this file, with all digits.

    """
    scene = scene_named(case)
    width, height = scene.camera.width, scene.camera.height
    if not (0 <= x < width and 0 <= y < height):
        raise UsageError(f"pixel ({x}, {y}) lies outside the image: X from 0 to {width - 1}, Y from 0 to {height - 1}")
    chosen = configurations(configuration or ("float32", "float64"), formula)
    names = references_named(require)
    tested = subject_named(subject, env, declare)
    scene = tested.capabilities.asked(scene)
    shout(faults := sorted({fault for choice in chosen for fault in choice.faults}))
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    answers = [] if tested.is_tracer else [subject_answers(tested, scene)]
    answers += [tracer_answers(configuration, scene) for configuration in chosen]
    answers += [reference_answers(name, scene, cached=cache) for name in names if name != tested.name]
    columns = {renderer.name: column_of(scene, renderer, x, y) for renderer in answers}
    from rayproof.reports.commands.nearby_answers import nearby_answers, show_nearby
    from rayproof.reports.judge.oracle import ORACLE

    nearby = nearby_answers(scene, answers, x, y)
    judged = {of_renderer.renderer: of_renderer.as_json() for of_renderer in nearby}
    write_json(json, {"case": case, "pixel": [x, y], "faults": faults, "renderers": columns, "over_limit": judged})
    say(f"{case}, pixel ({x}, {y}) of {width} x {height}, {scene.shading} light")
    show_pixel(columns)
    answering = [renderer.name for renderer in answers if renderer.answers and renderer.name != ORACLE]
    show_nearby(nearby, [name for name in answering if name not in judged])
    return 0


def show_pixel(columns: dict[str, Column]) -> None:
    """Print a pixel stage by stage, with a line for each renderer, within 80 columns; then the reasons for absences."""
    absent = [name for name in columns if is_absent(name)]
    present = {name: column for name, column in columns.items() if name not in absent}
    channels = dict.fromkeys(name for column in present.values() for name in column)
    stages: dict[str, list[str]] = {}
    for channel in channels:
        stage, dot, last = channel.rpartition(".")
        if dot:
            stages.setdefault(stage, []).append(last)
    for stage, names in stages.items():
        for first in range(0, len(names), ACROSS):
            across = names[first : first + ACROSS]
            say(f"{stage:<{NAME}}" + "".join(f"{name:>{NUMBER}}" for name in across))
            for renderer, column in present.items():
                cells = [column.get(f"{stage}.{name}") for name in across]
                if any(cell is not None for cell in cells):
                    numbers = "".join(f"{'' if cell is None else short(cell):>{NUMBER}}" for cell in cells)
                    named = f"  {renderer:<{NAME - 2}}"
                    if len(named) > NAME:
                        say(named)
                        named = " " * NAME
                    say(f"{named}{numbers}")
    silent: dict[tuple[str, str], list[str]] = {}
    for renderer, column in present.items():
        for name, value in column.items():
            if "." not in name and isinstance(value, str):
                silent.setdefault((renderer, value), []).append(name)
    for (renderer, why), names in silent.items():
        sentence = f"{renderer}, {', '.join(names)}: {why}"
        for line in textwrap.wrap(sentence, WIDTH, subsequent_indent="  ", break_long_words=False):
            say(line)
    if absent:
        say(f"not installed: {', '.join(absent)} (see rayproof list references)")


def is_absent(name: str) -> bool:
    """Return whether a renderer is a reference whose program is not installed."""
    from rayproof.reference import REFERENCES

    missing = getattr(REFERENCES[name], "missing", None) if name in REFERENCES else None
    return missing is not None and missing() is not None


def subject_answers(subject: "Subject", scene: Scene) -> "Answers":
    """Return the images of a subject other than the tracer."""
    from rayproof.reports.run.workers import answered

    with told_in_one_line():
        return replace(answered(subject, scene), name=subject.name)


def tracer_answers(configuration: "Configuration", scene: Scene) -> "Answers":
    """Return the tracer's images, or the reason why its precision is too low for the scene."""
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.run.tracer_task import trace
    from rayproof.tracer.shapes.bounds import beyond

    name, precision = f"tracer-{configuration.name}", configuration.precision
    if (refusal := beyond(scene, precision)) is not None:
        return Answers(name=name, precision=precision, unsupported=dict.fromkeys(Stage, refusal))
    return replace(trace(scene, configuration.name).answers, name=name)


def reference_answers(name: str, scene: Scene, *, cached: bool) -> "Answers":
    """Return the images of a reference, or the reason why it has none."""
    from rayproof.reports.run.worker_tasks import render_reference

    return render_reference(name, scene, cached=cached).answers


def column_of(scene: Scene, renderer: "Answers", x: int, y: int) -> Column:
    """Return a renderer's values at a pixel, and a reason for each stage that it does not support."""
    from rayproof.reports.judge.oracle import stages_of

    if renderer.error is not None:
        return {str(stage): f"error: {renderer.error}" for stage in stages_of(scene)}
    refused = {str(stage): f"unsupported: {why}" for stage, why in renderer.unsupported.items()}
    return pixel(scene, x, y, renderer.answers) | refused


def pixel(scene: Scene, x: int, y: int, answers: StageImages) -> Column:
    """Return the values of all stages at pixel (x, y) by channel name, with its coordinates in the camera stage."""
    column: Column = {}
    if camera := answers.get(Stage.CAMERA):
        for name in ("ndc", "pixel"):
            column |= {
                f"camera.{name}.{axis}": float(value) for axis, value in zip("XY", camera[name][y, x], strict=True)
            }
    for stage in IMAGE_STAGES:
        if stage in answers:
            names = exr_channels(stage, lights=len(scene.lights))
            values = np.asarray(answers[stage])[y, x]
            column |= {label(name): float(value) for name, value in zip(names, values, strict=True)}
    return column


def label(channel: str) -> str:
    """Return the name of a channel's row; OpenEXR's channels R, G and B contain the radiance."""
    return f"radiance.{channel}" if channel in {"R", "G", "B"} else channel


def short(value: float | str) -> str:
    """Return the text of a cell; numbers have nine digits, which distinguish any two float32 numbers."""
    return value if isinstance(value, str) else f"{value:.9g}"
