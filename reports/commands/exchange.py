"""`rayproof import` and `rayproof export`: scenes from other programs' files, and into them."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from rayproof.reports.called import called
from rayproof.reports.commands.lookup import scene_named
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder


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
