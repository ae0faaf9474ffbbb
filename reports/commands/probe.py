"""`rayproof probe`: one pixel, every stage, as the tracer in both precisions and every reference answer it."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.commands.lookup import Repeated, configurations, references_named, scene_named
from rayproof.reports.commands.output import say, shout, show_table, write_json
from rayproof.reports.commands.run import subject_named
from rayproof.reports.commands.usage import UsageError, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.subjects import Subject
    from rayproof.tracer.configuration import Configuration

Column = dict[str, float | str]  # row name -> number, or the sentence that says why there is none


def probe(
    case: str,
    x: int,
    y: int,
    *,
    formula: Repeated = (),
    require: Repeated = (),
    subject: str = "tracer",
    env: Repeated = (),
    cache: bool = True,
    json: Path | None = None,
) -> int:
    """Show one pixel, every stage, as each renderer answers it.

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    x
        The pixel's column; 0 is the left one.
    y
        The pixel's row; 0 is the top one.
    formula
        A formula for the tracer, such as triangle=signed_areas, or a function of one's own as
        sphere=./mine.py:nearest_hit. Repeatable.
    require
        A reference that answers on request only, such as certified. Repeatable.
    subject
        Another renderer, whose answers come first: a reference by name, or "exec:COMMAND {scene} {output}".
    env
        A variable of the environment that a program gets beside the usual ones. Repeatable.
    cache
        Take from the cache what references answered before; the tracer always renders.
    json
        Also write the values to this file, all digits.

    """
    scene = scene_named(case)
    width, height = scene.camera.width, scene.camera.height
    if not (0 <= x < width and 0 <= y < height):
        raise UsageError(f"pixel ({x}, {y}) lies outside the image: X from 0 to {width - 1}, Y from 0 to {height - 1}")
    chosen = configurations(["float32", "float64"], formula)
    names = references_named(require)
    tested = subject_named(subject, env)
    scene = tested.capabilities.under_its_light(scene)
    shout(faults := sorted({fault for one in chosen for fault in one.faults}))
    from rayproof.tracer.kernel.compiler import select

    select()
    columns = {} if tested.is_tracer else {tested.name: subject_pixel(tested, scene, x, y)}
    columns |= {f"tracer-{one.name}": tracer_pixel(one, scene, x, y) for one in chosen}
    columns |= {name: reference_pixel(name, scene, x, y, cached=cache) for name in names if name != tested.name}
    write_json(json, {"case": case, "pixel": [x, y], "faults": faults, "renderers": columns})
    say(f"{case}, pixel ({x}, {y}) of {width} x {height}, {scene.shading} light")
    stages = dict.fromkeys(name for column in columns.values() for name in column)
    rows = [[name, *(short(column.get(name, "")) for column in columns.values())] for name in stages]
    show_table("One pixel, every stage", ["stage", *columns], rows)
    return 0


def subject_pixel(subject: "Subject", scene: Scene, x: int, y: int) -> Column:
    """Return what another renderer than the tracer answers at a pixel, or why it does not."""
    from rayproof.reports.judge.oracle import stages_of
    from rayproof.reports.run.asking_subject import answered

    with told_in_one_line():
        found = answered(subject, scene)
    if found.error is not None:
        return {str(stage): f"error: {found.error}" for stage in stages_of(scene)}
    refused = {str(stage): f"unsupported: {why}" for stage, why in found.unsupported.items()}
    return pixel(scene, x, y, found.answers or {}) | refused


def tracer_pixel(configuration: "Configuration", scene: Scene, x: int, y: int) -> Column:
    """Return what the tracer answers at a pixel, or why the scene is beyond its precision."""
    from rayproof.reports.judge.oracle import stages_of
    from rayproof.tracer.render import render
    from rayproof.tracer.shapes.bounds import beyond

    if (refusal := beyond(scene, configuration.precision)) is not None:
        return {str(stage): f"unsupported: {refusal}" for stage in Stage}
    return pixel(scene, x, y, render(scene, stages_of(scene), configuration))


def reference_pixel(name: str, scene: Scene, x: int, y: int, *, cached: bool) -> Column:
    """Return what a reference answers at a pixel, or why it cannot."""
    from rayproof.reference import REFERENCES
    from rayproof.reports.run.messages import ReferenceTask
    from rayproof.reports.run.tasks.reference_task import heard

    task = ReferenceTask(scene=scene, samples=1, cached=cached)
    witness = heard(name, REFERENCES[name](), task, independent=False)
    refused = {str(stage): f"unsupported: {why}" for stage, why in witness.unsupported.items()}
    return pixel(scene, x, y, witness.answers) | refused


def pixel(scene: Scene, x: int, y: int, answers: StageImages) -> Column:
    """Return a pixel's values by the names of the stages' channels; of the camera what it says about this pixel."""
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
    """Return a row's name; OpenEXR's plain R, G and B are the radiance."""
    return f"radiance.{channel}" if channel in {"R", "G", "B"} else channel


def short(value: float | str) -> str:
    """Return a cell: nine digits, which tell any two float32 numbers apart."""
    return value if isinstance(value, str) else f"{value:.9g}"
