"""`rayproof probe`: one pixel, every stage, by every renderer; certified bounds; or one call of a program, kept."""

import textwrap
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Group, Parameter

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.commands.lookup import (
    USUAL_LIMIT,
    Repeated,
    configurations,
    references_named,
    scene_named,
    stages_named,
    subject_named,
)
from rayproof.reports.commands.output import say, shout, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from rayproof.reports.results.files import plain

if TYPE_CHECKING:
    from rayproof.cases.scene import Camera
    from rayproof.reference.certified import EnclosedPixel
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.subjects import Subject
    from rayproof.tracer.configuration import Configuration

FAILED = 1
ALL = "ray,object,distance,position,normal,visibility,irradiance,exitance,radiance"
MOST_PIXELS = 100_000  # some ten seconds of work, and half a gigabyte of JSON
OF_KEEP = Parameter(group=Group("One call of a program, kept", sort_key=1))
OF_CERTIFIED = Parameter(group=Group("Certified bounds", sort_key=2))
WIDTH, NAME, NUMBER, ACROSS = 80, 26, 17, 3  # columns of a line, of a renderer's name, of a number; numbers a line
Column = dict[str, float | str]  # row name -> number, or the sentence that says why there is none


def probe(
    case: str,
    x: int | None = None,
    y: int | None = None,
    *,
    configuration: Repeated = (),
    formula: Repeated = (),
    require: Repeated = (),
    subject: str = "tracer",
    env: Repeated = (),
    declare: Path | None = None,
    cache: bool = True,
    json: Path | None = None,
    keep: Annotated[Path | None, OF_KEEP] = None,
    timeout: Annotated[float | None, OF_KEEP] = None,
    certified: Annotated[bool, OF_CERTIFIED] = False,
    pixels: Annotated[str | None, OF_CERTIFIED] = None,
    stages: Annotated[str | None, OF_CERTIFIED] = None,
) -> int:
    """Show one pixel, every stage, as each renderer answers it, and what nearby problems answer if it is over a limit.

    For example: rayproof probe primitives/sphere 48 36 --subject radiance

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    x
        The pixel's column; 0 is the left one. X and Y may be left out with --keep or --certified.
    y
        The pixel's row; 0 is the top one.
    configuration
        A configuration of the tracer, as in `rayproof run`. Repeatable. Default: float32 and float64.
    formula
        A formula for the tracer, such as triangle=signed_areas, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Repeatable.
    require
        A reference that answers on request only, such as certified. Repeatable.
    subject
        Another renderer, whose values come first: a reference by name, "exec:COMMAND {scene} {output}",
        "serve:COMMAND" or "python:FILE.py:FUNCTION".
    env
        An environment variable to pass to a program, as in `rayproof run`. Repeatable.
    declare
        A JSON file with what a program does not say itself, as in `rayproof run`.
    cache
        Reuse answers of references from the cache; the tracer always renders.
    json
        Also write the values to this file, all digits. With --certified: [low, high] per channel, the bits used, and
        what is undecided, of every pixel.
    keep
        Call the program of --subject once and show no pixel. This folder gets scene.json, meshes, the image, and
        call.txt with the command, exit code and standard error.
    timeout
        Time limit [s] of the call. Default: 120.
    certified
        Enclose the exact value of every stage between two float64 numbers, with proof.
    pixels
        x0,y0,x1,y1: the rectangle's first and last column and row, all included; 0,0 is the top left pixel. Default:
        X and Y, or the whole image.
    stages
        Comma-separated stages, such as distance,normal,radiance. Default: all.

    """
    if keep is None and timeout is not None:
        raise UsageError("--timeout needs --keep FOLDER")
    if not certified and (pixels is not None or stages is not None):
        raise UsageError("--pixels and --stages need --certified")
    if (x is None) != (y is None):
        raise UsageError("X and Y go together")
    if keep is not None:
        if certified or x is not None or configuration or formula or require or json is not None:
            raise UsageError("--keep takes --subject, --env, --declare and --timeout only")
        return keep_call(
            case, keep, subject=subject, timeout=USUAL_LIMIT if timeout is None else timeout, env=env, declare=declare
        )
    if certified:
        if configuration or formula or require or env or declare is not None or subject != "tracer":
            raise UsageError("--certified takes --pixels, --stages and --json only")
        if x is not None and pixels is not None:
            raise UsageError("name either X and Y or --pixels")
        chosen_pixels = pixels if x is None else f"{x},{y},{x},{y}"
        return show_certified(case, pixels=chosen_pixels, stages=stages or ALL, json=json)
    if x is None or y is None:
        raise UsageError("name the pixel: rayproof probe CASE X Y")
    scene = scene_named(case)
    width, height = scene.camera.width, scene.camera.height
    if not (0 <= x < width and 0 <= y < height):
        raise UsageError(f"pixel ({x}, {y}) lies outside the image: X from 0 to {width - 1}, Y from 0 to {height - 1}")
    chosen = configurations(configuration or ("float32", "float64"), formula)
    names = references_named(require)
    tested = subject_named(subject, env, declare)
    scene = tested.capabilities.asked(scene)
    shout(faults := sorted({fault for one in chosen for fault in one.faults}))
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
    """Print a pixel stage by stage, a renderer a line, within 80 columns; then why some say nothing."""
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
        said = f"{renderer}, {', '.join(names)}: {why}"
        for line in textwrap.wrap(said, WIDTH, subsequent_indent="  ", break_long_words=False):
            say(line)
    if absent:
        say(f"not installed: {', '.join(absent)} (see rayproof list references)")


def is_absent(name: str) -> bool:
    """Return whether a renderer is a reference whose program is not installed."""
    from rayproof.reference import REFERENCES

    missing = getattr(REFERENCES[name], "missing", None) if name in REFERENCES else None
    return missing is not None and missing() is not None


def subject_answers(subject: "Subject", scene: Scene) -> "Answers":
    """Return the answers of another renderer than the tracer."""
    from rayproof.reports.run.workers import answered

    with told_in_one_line():
        return replace(answered(subject, scene), name=subject.name)


def tracer_answers(configuration: "Configuration", scene: Scene) -> "Answers":
    """Return what the tracer answers, or why the scene is beyond its precision."""
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.run.tracer_task import trace
    from rayproof.tracer.shapes.bounds import beyond

    name, precision = f"tracer-{configuration.name}", configuration.precision
    if (refusal := beyond(scene, precision)) is not None:
        return Answers(name=name, precision=precision, unsupported=dict.fromkeys(Stage, refusal))
    return replace(trace(scene, configuration.name).answers, name=name)


def reference_answers(name: str, scene: Scene, *, cached: bool) -> "Answers":
    """Return the answers of a reference, or why it has none."""
    from rayproof.reports.run.worker_tasks import render_reference

    return render_reference(name, scene, cached=cached).answers


def column_of(scene: Scene, renderer: "Answers", x: int, y: int) -> Column:
    """Return a renderer's values at a pixel, and a sentence for each stage that it does not answer."""
    from rayproof.reports.judge.oracle import stages_of

    if renderer.error is not None:
        return {str(stage): f"error: {renderer.error}" for stage in stages_of(scene)}
    refused = {str(stage): f"unsupported: {why}" for stage, why in renderer.unsupported.items()}
    return pixel(scene, x, y, renderer.answers) | refused


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


def keep_call(
    case: str, folder: Path, *, subject: str, timeout: float, env: tuple[str, ...], declare: Path | None
) -> int:
    """Call a program under test once, and keep what it was handed, its command, and what it said and wrote."""
    if not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    scene = scene_named(case)
    tested = subject_named(subject, env, declare, seconds=timeout)
    from rayproof.reports.run.workers import answered
    from rayproof.reports.subjects.calls import TOLD
    from rayproof.reports.subjects.choosing import KNOWN

    if not tested.is_program:
        raise UsageError(f"--subject: a call is a program's, {KNOWN}; got {subject!r}")
    scene = tested.capabilities.asked(scene)
    with told_in_one_line():
        writable_folder(folder)
        answered_call = answered(tested, scene, keep=folder)
    if (refusal := tested.capabilities.refusal(scene)) is not None:
        say(f"{case}: not handed over, beyond what it declares: {refusal}")
        return 0
    for line in (folder / TOLD).read_text(encoding="utf-8").splitlines():
        say(line)
    say("")
    if answered_call.error is not None:
        say(f"{case}: {answered_call.error}")
    else:
        say(f"{case}: stages {', '.join(answered_call.answers or {}) or 'none'}")
    say(f"what it was handed, said and wrote is in {folder}, this as {TOLD}")
    return 0 if answered_call.error is None else FAILED


def show_certified(scene: str, *, pixels: str | None, stages: str, json: Path | None) -> int:
    """Enclose the exact value of every stage between two float64 numbers, with proof."""
    asked = stages_named(stages)
    loaded = scene_named(scene)
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    box = rectangle(pixels, loaded.camera)
    from rayproof.cases.stages import exr_channels
    from rayproof.reference.certified import (
        Certified,  # not by the registry, which would load every other reference first
    )

    certified = Certified()
    left, top, right, bottom = box
    chosen = [(x, y) for y in range(top, bottom + 1) for x in range(left, right + 1)]
    records = certified.enclose(loaded, asked, chosen)
    undecided = [{"pixel": record["pixel"], "what": record["undecided"]} for record in records if record["undecided"]]
    names = {str(stage): list(exr_channels(stage, lights=len(loaded.lights))) for stage in asked}
    content = {
        "scene": scene,
        "reference": certified.version(),
        "rectangle": list(box),
        "channels": names,
        "pixels": records,
        "undecided": undecided,
    }
    write_json(json, content)
    if len(records) == 1:
        _show_pixel(scene, names, records[0])
    else:
        bits = ", ".join(
            f"{count} with {bits} bits" for bits, count in sorted(Counter(r["bits"] for r in records).items())
        )
        ties = sum(record["exact"] for record in records)
        say(f"{scene}: {len(records)} pixels enclosed, {bits}; {ties} decided by exact numbers")
    say(f"undecided: {len(undecided) or 'none'}")
    for record in undecided[:10]:
        say(f"  pixel ({record['pixel'][0]}, {record['pixel'][1]}): {', '.join(record['what'])}")
    return 0


def rectangle(pixels: str | None, camera: "Camera") -> tuple[int, int, int, int]:
    """Return the first and last column and row of the pixels that are named; all of them by default.

    Raises:
        UsageError: not four whole numbers, a corner outside the image, nothing inside, or too many pixels.

    """
    if pixels is None:
        box = (0, 0, camera.width - 1, camera.height - 1)
    else:
        try:
            left, top, right, bottom = (int(part) for part in pixels.split(","))
        except ValueError:
            raise UsageError(f"--pixels must read x0,y0,x1,y1 in whole numbers, got {pixels!r}") from None
        for x, y in ((left, top), (right, bottom)):
            if not (0 <= x < camera.width and 0 <= y < camera.height):
                raise UsageError(
                    f"--pixels: ({x}, {y}) lies outside the image: "
                    f"x from 0 to {camera.width - 1}, y from 0 to {camera.height - 1}"
                )
        if left > right or top > bottom:
            raise UsageError(f"--pixels: x0 must not exceed x1, nor y0 y1, got {pixels}")
        box = (left, top, right, bottom)
    count = (box[2] - box[0] + 1) * (box[3] - box[1] + 1)
    if count > MOST_PIXELS:
        raise UsageError(f"--pixels: at most {MOST_PIXELS} pixels at once, got {count}")
    return box


def _show_pixel(scene: str, names: dict[str, list[str]], record: "EnclosedPixel") -> None:
    rows = [
        [channel, repr(plain(low)), repr(plain(high))]
        for stage, channels in names.items()
        for channel, (low, high) in zip(channels, record["stages"][stage], strict=True)
    ]
    x, y = record["pixel"]
    show_table(f"{scene}, pixel ({x}, {y}), {record['bits']} bits", ["channel", "low", "high"], rows)
