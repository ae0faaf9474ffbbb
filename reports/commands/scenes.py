"""`rayproof render`, `import` and `export`: render a scene, or convert it from and to other programs' formats."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from rayproof.reports.commands.lookup import Repeated, configurations, scene_named, stages_named
from rayproof.reports.commands.output import say, shout, warning
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from rayproof.reports.program_name import called
from rayproof.reports.results.files import several

if TYPE_CHECKING:
    from rayproof.reports.interchange import Imported

MOST_LISTED = 4  # omissions, or kinds of them, at the end of an import's output, which has at most ten lines


def render(
    scene: str,
    image: Path,
    *,
    stages: str = "radiance",
    configuration: str = "float32",
    formula: Repeated = (),
    double: bool = False,
) -> int:
    """Render a scene with the tracer, without references or judging.

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
        A formula for it, such as triangle=signed_areas, or a function of your own as sphere=./mine.py:nearest_hit.
        Repeatable.
    double
        Trace in float64 and write every digit. OpenEXR has at most float32, so each channel X gets a second channel
        X.low, and X + X.low in float64 is the value.

    """
    if image.suffix.lower() not in (".exr", ".npz"):
        raise UsageError(f"the image must end in .exr or .npz, got {image}")
    chosen_stages = stages_named(stages)
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
    comment = warning(chosen.faults) if chosen.faults else chosen.name
    answers = trace(loaded, chosen_stages, chosen)
    if image.suffix.lower() == ".npz":
        write_arrays(image, answers, comments=comment)
    else:
        write_answers(image, answers, lights=len(loaded.lights), comments=comment, double=double)
    say(f"{image}: {', '.join(chosen_stages)} of {scene}, {chosen.name}")
    return 0


def import_scene(
    file: Path,
    *,
    out: Path | None = None,
    width: int | None = None,
    height: int | None = None,
    up: Literal["y", "z"] | None = None,
    allow_folder: Annotated[tuple[Path, ...], Parameter(negative="", show_default=False)] = (),
    define: Annotated[Repeated, Parameter(name="-D")] = (),
) -> int:
    """Convert another program's scene into a scene file, and list the features that were dropped.

    Reads Mitsuba 3 XML (.xml), glTF (.glb, .gltf) with its point lights, the lecture's scenes (.json), and OBJ, PLY
    and STL meshes, which get a camera and a light that show all of the mesh. The scene file refers to mesh files; those
    from other folders are copied into its folder.

    Parameters
    ----------
    file
        The file to read; the files to which it refers must be in its folder.
    out
        The scene file to write, ending in .json. Default: FILE's name with .json, or with -scene.json if FILE itself
        ends in .json, in the current folder.
    width
        Image width [px], in place of the file's. With --height.
    height
        Image height [px], in place of the file's. With --width.
    up
        The axis that points up in an OBJ, PLY or STL file, since these formats do not define it. Default: z.
    allow_folder
        A further folder from which FILE may include files, by `../` or the `<path>` of a Mitsuba scene. Repeatable.
    define
        A parameter of a Mitsuba scene, such as -D spp=16, in place of its `<default>`. Repeatable.

    """
    if (width is None) != (height is None):
        raise UsageError("--width and --height go together")
    target = out or Path(f"{file.stem}{'-scene' if file.suffix.lower() == '.json' else ''}.json")
    if target.suffix.lower() != ".json":
        raise UsageError(f"the scene file must end in .json, got {target}")
    if target.exists() and file.exists() and target.samefile(file):
        raise UsageError(f"--out {target} is the file that is read")
    for pair in define:
        if not re.fullmatch(r"\w+=.*", pair):
            raise UsageError(f"-D must be a name and a value, such as -D spp=16, got {pair}")
    if define and file.suffix.lower() != ".xml":
        raise UsageError(f"-D sets parameters of a Mitsuba scene, which ends in .xml, got {file}")
    from rayproof.reports import interchange
    from rayproof.reports.interchange.framing import DARK, is_dark

    options = interchange.ImportOptions(
        size=None if width is None or height is None else (width, height),
        allowed=allow_folder,
        up=up,
        parameters=dict(pair.split("=", 1) for pair in define),
    )
    with told_in_one_line():
        for folder in allow_folder:
            if not folder.is_dir():
                raise UsageError(f"--allow-folder {folder}: there is no such folder")
        imported = interchange.import_scene(file, options)
        dark = is_dark(imported.scene)
        writable_folder(target.parent)
        copies = interchange.save_imported(imported, target)
    for line in summary(imported, target, copies):
        say(line)
    if dark:
        say(f"note: {DARK}")
    say(f"next: {called()} run {target}")
    return 0


def summary(imported: "Imported", target: Path, copies: Sequence[str]) -> list[str]:
    """Return the printed lines of an import: all omissions, the files written, and the kinds of many omissions."""
    scene = imported.scene
    kinds = Counter(type(shape).__name__.lower() for shape in scene.shapes)
    shapes = ", ".join(several(count, kind) for kind, count in kinds.items())
    triangles = sum(len(getattr(shape, "faces", ())) for shape in scene.shapes)
    lines = [f"dropped: {sentence}" for sentence in imported.dropped]
    shapes += f" ({several(triangles, 'triangle')})" if triangles else ""
    made = [
        f"{target}: {shapes}, {several(len(scene.lights), 'light')}, {scene.camera.width} x {scene.camera.height} px"
    ]
    if copies:
        more = f" and {len(copies) - 1} others" if len(copies) > 1 else ""
        made.append(f"copied beside it: {copies[0]}{more}")
    if len(lines) <= MOST_LISTED:
        return [*lines, *made]
    # The kind of an omission is the end of its sentence, without the names in quotes.
    left_out = Counter(re.sub(r"\s*(['\"]).*?\1", "", line.rpartition(": ")[2]) for line in lines)
    made.append(f"left out or replaced: {len(lines)} things of {len(left_out)} kinds, all listed above")
    made += [f"  {count} x {kind}" for kind, count in left_out.most_common(MOST_LISTED)]
    if len(left_out) > MOST_LISTED:
        made.append(f"  and {len(left_out) - MOST_LISTED} kinds more")
    return [*lines, *made]


def export_scene(scene: str, file: Path) -> int:
    """Convert a scene to another program's format, and list the features that the format cannot represent.

    Writes Mitsuba 3 XML (.xml) with separate mesh files, glTF (.gltf), pbrt version 3 (.pbrt) and POV-Ray (.pov).
    Shapes that a format does not have become meshes.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    file
        The file to write, ending in .xml, .gltf, .pbrt or .pov.

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
