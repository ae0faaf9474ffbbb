"""Mesh files that a scene names (OBJ, PLY, STL, GLB): their path is checked, their size counted, then they are read.

Files that a mesh file names in turn are never opened. `READERS` is the table of the kinds of files: a function from a
file's content to vertices (n, 3) float64, triangles (m, 3) int64 and sentences about the content. It raises ValueError
with a sentence for a broken file.
"""

from collections.abc import Callable
from pathlib import Path, PurePosixPath

import numpy as np

from rayproof.cases.foreign_files import Budget, content_of, path_within
from rayproof.cases.registry import Entry, Table
from rayproof.cases.scene import SceneError, shown

LARGEST = 256 * 2**20  # bytes of a mesh file
READERS: Table[Callable[[bytes], tuple[np.ndarray, np.ndarray, list[str]]]] = Table(
    "kind of mesh file",
    package="rayproof.cases",
    entries={
        "obj": Entry("polygon_files:obj_mesh"),
        "ply": Entry("polygon_files:ply_mesh"),
        "stl": Entry("stl_files:stl_mesh"),
        "glb": Entry("gltf_meshes:glb_mesh"),  # imports SciPy, and few scenes need it
    },
)
KINDS = tuple(f".{kind}" for kind in READERS)


def mesh_path(name: str, folder: Path | None) -> Path:
    """Return the real path of the mesh file `name` inside `folder`.

    Raises:
        SceneError: there is no folder, or `name` is absolute, leads outside, or names no regular file of a known kind.

    """
    if folder is None:
        raise SceneError(f"file cannot be read without a scene file to be relative to, got {shown(name)}")
    return path_within(name, folder, what="file", largest=LARGEST, kinds=KINDS)


def read_mesh(name: str, folder: Path | None, budget: Budget | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) float64 [m] and faces (m, 3) of the mesh file `name` in `folder`, in the file's order.

    The nodes of a GLB scene are placed by their transforms and joined. `budget` is the scene's (default: a new one).

    Raises:
        SceneError: the file may not or cannot be read, or has no triangles; the message begins with "file".

    """
    path = mesh_path(name, folder)
    budget = budget or Budget()
    if path not in budget.meshes:
        budget.meshes[path] = _parsed(path, name, budget)
    vertices, faces = budget.meshes[path]
    # For every shape that names the file, because each has its own arrays.
    budget.spend("triangles", len(faces), by=f"file {shown(name)}")
    budget.expand(vertices.nbytes + faces.nbytes, by=f"file {shown(name)}")
    return vertices.copy(), faces.copy()


def _parsed(path: Path, name: str, budget: Budget) -> tuple[np.ndarray, np.ndarray]:
    """Read a file and return its vertices and faces."""
    kind = PurePosixPath(name).suffix.lower()[1:]
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"file cannot be read: {error.strerror}: {shown(name)}") from None
    budget.count_file(path, len(content))
    try:
        vertices, faces, notes = READERS[kind](content)
    except ValueError as error:  # a SceneError is one, too
        reason = " ".join(shown(str(error), 200)[1:-1].split())
        raise SceneError(f"file cannot be understood as {kind.upper()} ({reason}): {shown(name)}") from None
    if not len(faces):
        raise SceneError(f"file holds no triangles: {shown(name)}")
    budget.notes[path] = tuple(notes)
    return vertices, faces
