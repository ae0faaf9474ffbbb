"""Read a mesh from an OBJ, PLY, STL or GLB file in the scene's own folder; parsed by trimesh, distrusted before that.

A scene file may come from anybody. So its mesh must lie inside the scene's folder after every link is followed, its
header must not claim more than its bytes can hold, and nothing that the mesh file names in turn is ever opened.
"""

import re
from pathlib import Path, PurePosixPath

import numpy as np

from rayproof.cases.budget import BYTES_A_BYTE, FREE_BYTES, Budget
from rayproof.cases.foreign import ForeignError, ask
from rayproof.cases.mesh_headers import CLAIMS
from rayproof.cases.own_folder import content_of, path_within
from rayproof.cases.scene import SceneError
from rayproof.cases.scene_fields import shown

LARGEST = 256 * 2**20  # bytes of a mesh file
# What trimesh may take, beside its own code: a text file of 2 million triangles needs a third of it.
SECONDS, BYTES_A_SECOND = 6.0, 2**20
MEMORY, MEMORY_A_BYTE = 512 * 2**20, 40  # bytes
# Where an OBJ file has several materials, trimesh puts the faces of each together, the last material's first.
MATERIALS = re.compile(rb"^[ \t]*usemtl\b[^\n]*", re.MULTILINE)


def mesh_path(name: str, folder: Path | None) -> Path:
    """Return the real path of the mesh file `name` inside `folder`.

    Raises:
        SceneError: there is no folder, or `name` is absolute, leads outside, or names no regular file of a known kind.

    """
    if folder is None:
        raise SceneError(f"file cannot be read without a scene file to be relative to, got {shown(name)}")
    return path_within(name, folder, what="file", largest=LARGEST, kinds=tuple(CLAIMS))


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
    suffix = PurePosixPath(name).suffix.lower()
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"file cannot be read: {error.strerror}: {shown(name)}") from None
    budget.count_file(path, len(content))
    problem = CLAIMS[suffix](content)
    if problem:
        raise SceneError(f"file {problem}: {shown(name)}")
    if suffix == ".obj":
        content = MATERIALS.sub(b"", content)
    try:
        facts, arrays = ask(
            "rayproof.cases.mesh_parsing",
            suffix[1:],
            content,
            seconds=SECONDS + len(content) / BYTES_A_SECOND,
            memory=MEMORY + MEMORY_A_BYTE * len(content),
            most=FREE_BYTES + BYTES_A_BYTE * len(content),
        )
    except ForeignError as error:
        reason = " ".join(shown(str(error), 200)[1:-1].split())
        raise SceneError(f"file cannot be understood as {suffix[1:].upper()} ({reason}): {shown(name)}") from None
    if facts["triangles"] == 0:
        raise SceneError(f"file holds no triangles: {shown(name)}")
    # Where there are too many, nothing but their number came back.
    budget.spend("triangles", 0 if arrays else facts["triangles"], by=f"file {shown(name)}")
    numbers = 3 * facts["vertices"]
    vertices = np.frombuffer(arrays, np.float64, numbers).reshape(-1, 3)
    return vertices, np.frombuffer(arrays, np.int64, offset=8 * numbers).reshape(-1, 3)
