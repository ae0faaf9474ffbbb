"""`rayproof render`: the tracer alone, from a scene file to an OpenEXR image with one channel group per stage."""

from pathlib import Path

from rayproof.reports.commands.lookup import configurations, scene_named, stages_named
from rayproof.reports.commands.output import say, shout, warning
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder


def render(scene: str, image: Path, *, stages: str = "radiance", configuration: str = "float32") -> int:
    """Render a scene file with the tracer alone.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    image
        The OpenEXR file to write, ending in .exr.
    stages
        Comma-separated stages, such as distance,normal,radiance.
    configuration
        The tracer's configuration, such as float64/triangle=signed_areas.

    """
    if image.suffix.lower() != ".exr":
        raise UsageError(f"the image must end in .exr, got {image}")
    asked = stages_named(stages)
    (chosen,) = configurations([configuration], [])
    loaded = scene_named(scene)
    with told_in_one_line():
        writable_folder(image.parent)
    from rayproof.reports.results.exr import write_answers
    from rayproof.tracer.device.llvm import select
    from rayproof.tracer.render import render as trace
    from rayproof.tracer.shapes.representable import beyond

    if (refusal := beyond(loaded, chosen.precision)) is not None:
        raise UsageError(f"{scene}: {refusal}")
    shout(chosen.faults)
    select()
    said = warning(chosen.faults) if chosen.faults else chosen.name
    write_answers(image, trace(loaded, asked, chosen), lights=len(loaded.lights), comments=said)
    say(f"{image}: {', '.join(asked)} of {scene}, {chosen.name}")
    return 0
