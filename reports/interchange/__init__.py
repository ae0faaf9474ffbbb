"""Import and export of other programs' scenes: the registries of formats.

To add a format: a function `(path, options) -> Imported` under `@IMPORTERS.register(".suffix")`, a function `(scene,
path) -> dropped` under `@EXPORTERS.register(".suffix", says=SceneFormat(...))`, in a new file or folder here. A reader
returns a sentence for each part that it left out or changed; it drops nothing silently. Files are untrusted: an error
is a SceneError of one line with the file and the place in it, and only files in the scene's own folder and in the
folders that the options allow are read. A writer gets only shapes of the types in its format's `SceneFormat`.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from rayproof.cases.mesh_files import mesh_path
from rayproof.cases.registry import Registry
from rayproof.cases.scene import CLIPS, SHADINGS, Clip, Mesh, Scene, SceneError, Shading, Shape
from rayproof.cases.scene_json import NAMES, PACKED, SHAPES, save_scene
from rayproof.reports.results.files import replacing

Size = tuple[int, int] | None
MOST_NAMED = 5  # things left out that a refusal names


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """The user's options for a file that is imported."""

    size: Size = None  # width and height [px], in place of the file's
    allowed: tuple[Path, ...] = ()  # folders, in addition to the file's own, whose files it may name
    up: Literal["y", "z"] | None = None  # the axis that points up, if the file does not contain it
    parameters: Mapping[str, str] = field(default_factory=dict)  # of a Mitsuba scene, by name


@dataclass(frozen=True, kw_only=True)
class Imported:
    """A scene read from another program's file, and sentences about the parts that were left out."""

    scene: Scene  # a mesh as its file has it names that file by its whole path
    dropped: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class SceneFormat:
    """The features of a scene that a format has; others are replaced by equivalent ones, or refused."""

    title: str
    # A feature that the format lacks -> its treatment in a run.
    cannot_say: Mapping[str, str]
    shapes: tuple[str, ...] = tuple(SHAPES)
    shading: tuple[Shading, ...] = SHADINGS
    clip: tuple[Clip, ...] = CLIPS
    two_sided: bool | Literal["always"] = True  # "always": a program sees and shades both sides of all surfaces
    greatest_albedo: float = float("inf")
    world_normals: bool = False  # meshes are written with corners rounded to float32 in world space
    program: str = ""  # the reference that reads the format: its tolerances apply if no epsilons are declared
    half: bool = False  # its programs write half floats, to whose range the lights are scaled
    lights: int = 0  # 1: programs sample one of several lights at random, so that each light is rendered separately


IMPORTERS: Registry[Callable[[Path, ImportOptions], Imported]] = Registry(
    "importer", package="rayproof.reports.interchange"
)
EXPORTERS: Registry[Callable[[Scene, Path], tuple[str, ...]]] = Registry(
    "exporter", package="rayproof.reports.interchange"
)


def import_scene(path: Path, options: ImportOptions | None = None) -> Imported:
    """Return the scene in another program's file, whose suffix determines the format.

    Raises:
        SceneError: the file is missing, of no known kind, malformed, or nothing in it is visible.

    """
    suffix = path.suffix.lower()
    if suffix not in IMPORTERS:
        raise SceneError(f"{path}: must end in one of {', '.join(IMPORTERS)}")
    if not path.exists():
        raise SceneError(f"{path}: there is no such file")
    if not path.is_file():
        raise SceneError(f"{path}: is no regular file")
    # Numbers of a file may overflow in computations; the scene then refuses the result by name.
    with np.errstate(all="ignore"):
        imported = IMPORTERS[suffix](path, options or ImportOptions())
    if not imported.scene.shapes:
        why = f"; left out: {', '.join(imported.dropped[:MOST_NAMED])}" if imported.dropped else ""
        raise SceneError(f"{path}: no shape of it can be read, so there is nothing to see{why}")
    return imported


def save_imported(imported: Imported, target: Path) -> tuple[str, ...]:
    """Write a scene file that names the mesh files, and return the names of the files that were copied into its folder.

    A mesh file must be in the scene file's folder, so a file from elsewhere is copied there. Meshes without a file of
    their own, or whose file would be read differently here (turned around), are packed into the scene file.

    Raises:
        OSError: a file cannot be read or written.

    """
    copies: dict[Path, str] = {}
    folder = target.parent.resolve()

    def placed(shape: Shape) -> Shape:
        if not isinstance(shape, Mesh) or shape.file is None:
            return shape
        source = Path(shape.file)
        if source.is_relative_to(folder):
            name = source.relative_to(folder).as_posix()
        elif source not in copies:
            name = copies[source] = _copied(source, folder)
        else:
            name = copies[source]
        try:
            mesh_path(name, folder)
        except SceneError:  # a name that no scene file may have, with a line end in it
            return replace(shape, file=None)
        return replace(shape, file=name)

    scene = replace(imported.scene, shapes=tuple(placed(shape) for shape in imported.scene.shapes))
    save_scene(scene, target, packed=PACKED, named=True)
    return tuple(copies.values())


def _copied(source: Path, folder: Path) -> str:
    """Copy a file into a folder and return its name there, which no other file has."""
    content = source.read_bytes()
    names = (source.name, f"{source.stem}-{hashlib.sha256(content).hexdigest()[:12]}{source.suffix}")
    free = (name for name in names if not (folder / name).exists() or (folder / name).read_bytes() == content)
    name = next(free, names[-1])
    with replacing(folder / name) as draft:
        draft.write_bytes(content)
    return name


def export_scene(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene` as another program's file and return sentences about features that the format lacks.

    Shapes that the format lacks are written as meshes: a cube, a square or a triangle as an equal mesh.

    Raises:
        SceneError: the suffix is unknown, or no mesh can replace a shape.
        OSError: the file cannot be written.

    """
    from rayproof.reports.interchange.stand_ins import FLAT, NoStandInError, rebuilt, tessellated

    suffix = path.suffix.lower()
    if suffix not in EXPORTERS:
        raise SceneError(f"{path}: must end in one of {', '.join(EXPORTERS)}")
    says: SceneFormat = EXPORTERS.about(suffix)["says"]
    names = [NAMES[type(shape)] for shape in scene.shapes]
    unsaid = [name for name in dict.fromkeys(names) if name not in says.shapes]
    try:
        scene = tessellated(scene, unsaid, squares="square" in says.shapes)
    except NoStandInError as error:
        raise SceneError(f"{path}: {error}") from None
    scene = rebuilt(scene, dict.fromkeys((name for name in FLAT if name not in says.shapes), "mesh")).scene
    moved = ("the camera's sample_offset: rays pass through the pixels' centres",) * any(scene.camera.sample_offset)
    how = {"sphere": "a mesh of flat triangles", "plane": "a square that ends beyond what is seen"}
    notes = [f"each {name}: it is {how.get(name, 'an equal mesh')}" for name in unsaid]
    return (*moved, *notes, *EXPORTERS[suffix](scene, path))
