"""`rayproof render`: the tracer alone, from a scene file to an image with all stages that are asked for."""

from dataclasses import replace
from pathlib import Path

from rayproof.reports.commands.lookup import Repeated, configurations, scene_named, stages_named
from rayproof.reports.commands.output import say, shout, warning
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder


def render(
    scene: str,
    image: Path,
    *,
    stages: str = "radiance",
    configuration: str = "float32",
    formula: Repeated = (),
    double: bool = False,
) -> int:
    """Render a scene file with the tracer alone.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    image
        The file to write: OpenEXR, ending in .exr, with one group of channels per stage; or NumPy's, ending in .npz,
        with one float64 array (height, width, channels) per stage.
    stages
        Comma-separated stages, such as distance,normal,radiance.
    configuration
        The tracer's configuration, such as float64/triangle=signed_areas.
    formula
        A formula for it, such as triangle=signed_areas, or a function of one's own as sphere=./mine.py:nearest_hit.
        Repeatable.
    double
        Trace in float64 and write every digit: in OpenEXR, which has float32 at most, beside each channel X a channel
        X.low, so that X + X.low in float64 is the value.

    """
    if image.suffix.lower() not in (".exr", ".npz"):
        raise UsageError(f"the image must end in .exr or .npz, got {image}")
    asked = stages_named(stages)
    (chosen,) = configurations([configuration], formula)
    chosen = replace(chosen, precision="float64") if double else chosen
    loaded = scene_named(scene)
    with told_in_one_line():
        writable_folder(image.parent)
    from rayproof.reports.results.exr import write_answers, write_arrays
    from rayproof.tracer.kernel.compiler import select
    from rayproof.tracer.render import render as trace
    from rayproof.tracer.shapes.bounds import beyond

    if (refusal := beyond(loaded, chosen.precision)) is not None:
        raise UsageError(f"{scene}: {refusal}")
    shout(chosen.faults)
    select()
    said = warning(chosen.faults) if chosen.faults else chosen.name
    answers = trace(loaded, asked, chosen)
    if image.suffix.lower() == ".npz":
        write_arrays(image, answers, comments=said)
    else:
        write_answers(image, answers, lights=len(loaded.lights), comments=said, double=double)
    say(f"{image}: {', '.join(asked)} of {scene}, {chosen.name}")
    return 0
