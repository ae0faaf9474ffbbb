"""Exchange: other programs' scenes read into the specification's vocabulary, and written out of it.

To add a format: a function `(path, options) -> Imported` under `@IMPORTERS.register(".suffix")`, a function
`(scene, path) -> dropped` under `@EXPORTERS.register(".suffix")`, in a new file or folder here. A reader says in a
sentence each what it left out or changed; nothing is dropped in silence. Files are distrusted: whatever is wrong ends
in a SceneError of one line that names the file and the place, and nothing gets in from outside of the scene's own
folder and of the folders that the options allow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from rayproof.cases.registry import Registry
from rayproof.cases.scene import Scene, SceneError

Size = tuple[int, int] | None
MOST_NAMED = 5  # things left out that a refusal names


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """What the user says about a file that is imported."""

    size: Size = None  # width and height [px], in place of the file's
    allowed: tuple[Path, ...] = ()  # folders outside of the file's own from which it may name files
    up: Literal["y", "z"] | None = None  # the axis that points up, where the file does not say
    parameters: Mapping[str, str] = field(default_factory=dict)  # of a Mitsuba scene, by name


@dataclass(frozen=True, kw_only=True)
class Imported:
    """A scene read from another program's file, and what of that file it does not hold."""

    scene: Scene
    dropped: tuple[str, ...]


IMPORTERS: Registry[Callable[[Path, ImportOptions], Imported]] = Registry(
    "importer", package="rayproof.reports.interchange"
)
EXPORTERS: Registry[Callable[[Scene, Path], tuple[str, ...]]] = Registry(
    "exporter", package="rayproof.reports.interchange"
)


def import_scene(path: Path, options: ImportOptions | None = None) -> Imported:
    """Return the scene in another program's file; its suffix says which.

    Raises:
        SceneError: the file is missing, of no known kind, cannot be understood, or nothing of it can be seen.

    """
    suffix = path.suffix.lower()
    if suffix not in IMPORTERS:
        raise SceneError(f"{path}: must end in one of {', '.join(IMPORTERS)}")
    if not path.exists():
        raise SceneError(f"{path}: there is no such file")
    if not path.is_file():
        raise SceneError(f"{path}: is no regular file")
    # A file's numbers may leave the floats on the way; a scene refuses what comes of it, and says which.
    with np.errstate(all="ignore"):
        imported = IMPORTERS[suffix](path, options or ImportOptions())
    if not imported.scene.shapes:
        why = f"; left out: {', '.join(imported.dropped[:MOST_NAMED])}" if imported.dropped else ""
        raise SceneError(f"{path}: no shape of it can be read, so there is nothing to see{why}")
    return imported


def export_scene(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene` as another program's file and return what could not be said there.

    Raises:
        SceneError: the suffix is of no known kind.
        OSError: the file cannot be written.

    """
    suffix = path.suffix.lower()
    if suffix not in EXPORTERS:
        raise SceneError(f"{path}: must end in one of {', '.join(EXPORTERS)}")
    return EXPORTERS[suffix](scene, path)
