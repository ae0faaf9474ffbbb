"""Mesh files that a scene names (OBJ, PLY, STL, GLB): their path is checked, their size counted, then they are read.

Nothing that a mesh file names in turn is ever opened.
"""

from pathlib import Path, PurePosixPath

import numpy as np

from rayproof.cases.foreign_files import Budget, content_of, path_within
from rayproof.cases.polygon_files import mesh_of
from rayproof.cases.scene import SceneError, shown
from rayproof.cases.stl_files import read_stl

LARGEST = 256 * 2**20  # bytes of a mesh file
KINDS = (".obj", ".ply", ".stl", ".glb")


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
    # For every shape that names the file: each keeps arrays of its own.
    budget.spend("triangles", len(faces), by=f"file {shown(name)}")
    budget.expand(vertices.nbytes + faces.nbytes, by=f"file {shown(name)}")
    return vertices.copy(), faces.copy()


def _parsed(path: Path, name: str, budget: Budget) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a file that was not read yet."""
    kind = PurePosixPath(name).suffix.lower()[1:]
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"file cannot be read: {error.strerror}: {shown(name)}") from None
    budget.count_file(path, len(content))
    try:
        vertices, faces, notes = _mesh(kind, content)
    except ValueError as error:  # a SceneError is one, too
        reason = " ".join(shown(str(error), 200)[1:-1].split())
        raise SceneError(f"file cannot be understood as {kind.upper()} ({reason}): {shown(name)}") from None
    if not len(faces):
        raise SceneError(f"file holds no triangles: {shown(name)}")
    budget.notes[path] = tuple(notes)
    return vertices, faces


def _mesh(kind: str, content: bytes) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return vertices (n, 3) float64, triangles (m, 3) int64, and what to report of a file's content.

    Raises:
        ValueError: the content cannot be read; in words.

    """
    if kind == "stl":
        return read_stl(content)
    if kind == "glb":
        from rayproof.cases.gltf_meshes import glb_mesh  # here, because it imports SciPy and few scenes need it

        return *glb_mesh(content), []
    return mesh_of(kind, content)
