"""`rayproof render`, `import` and `export`: a scene as an image, from other programs' files, and into them."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from rayproof.reports.called import called
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
    from rayproof.reports.results.images import write_answers, write_arrays
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm
    from rayproof.tracer.render import render as trace
    from rayproof.tracer.shapes.bounds import beyond

    if (refusal := beyond(loaded, chosen.precision)) is not None:
        raise UsageError(f"{scene}: {refusal}")
    shout(chosen.faults)
    choose_packaged_llvm()
    said = warning(chosen.faults) if chosen.faults else chosen.name
    answers = trace(loaded, asked, chosen)
    if image.suffix.lower() == ".npz":
        write_arrays(image, answers, comments=said)
    else:
        write_answers(image, answers, lights=len(loaded.lights), comments=said, double=double)
    say(f"{image}: {', '.join(asked)} of {scene}, {chosen.name}")
    return 0


def import_scene(
    file: Path,
    *,
    out: Path | None = None,
    width: int | None = None,
    height: int | None = None,
    up: Literal["y", "z"] | None = None,
    allow_folder: Annotated[tuple[Path, ...], Parameter(negative="", show_default=False)] = (),
) -> int:
    """Turn another program's scene into a scene file, and list what was dropped.

    Reads Mitsuba 3 XML (.xml), glTF (.glb, .gltf) with its point lights, and OBJ, PLY and STL meshes, which get a
    camera and a light that show all of the mesh.

    Parameters
    ----------
    file
        The file to read; what it names must lie in its own folder.
    out
        The scene file to write, ending in .json. Default: FILE's name with .json, in the current folder.
    width
        Image width [px], in place of the file's. With --height.
    height
        Image height [px], in place of the file's. With --width.
    up
        The axis that points up in an OBJ, PLY or STL file, none of which says so. Default: z.
    allow_folder
        A folder outside of FILE's own in which the `<path>` of a Mitsuba scene may look for files. Repeatable.

    """
    if (width is None) != (height is None):
        raise UsageError("--width and --height go together")
    target = out or Path(f"{file.stem}.json")
    if target.suffix.lower() != ".json":
        raise UsageError(f"the scene file must end in .json, got {target}")
    from rayproof.cases.scene_json import save_scene
    from rayproof.reports import interchange
    from rayproof.reports.interchange.framing import is_dark

    options = interchange.ImportOptions(
        size=None if width is None or height is None else (width, height), allowed=allow_folder, up=up
    )
    with told_in_one_line():
        for folder in allow_folder:
            if not folder.is_dir():
                raise UsageError(f"--allow-folder {folder}: there is no such folder")
        imported = interchange.import_scene(file, options)
        dark = is_dark(imported.scene)
        writable_folder(target.parent)
        save_scene(imported.scene, target)
    for sentence in imported.dropped:
        say(f"dropped: {sentence}")
    if dark:
        say("note: no pixel of it is lit: every surface in view is in shadow, or turned away from camera or lights")
    shapes, lights = len(imported.scene.shapes), len(imported.scene.lights)
    say(f"{target}: {shapes} shapes, {lights} lights; judge it with: {called()} run {target}")
    return 0


def export_scene(scene: str, file: Path) -> int:
    """Write a scene as Mitsuba 3 XML, its meshes beside it, and list what that format cannot say.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    file
        The file to write, ending in .xml.

    """
    loaded = scene_named(scene)
    from rayproof.reports import interchange

    with told_in_one_line():
        writable_folder(file.parent)
        dropped = interchange.export_scene(loaded, file)
    for sentence in dropped:
        say(f"note: {sentence}")
    say(f"{file}: {len(loaded.shapes)} shapes, {len(loaded.lights)} lights")
    return 0
