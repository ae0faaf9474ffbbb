"""Read a mesh from an OBJ, PLY, STL or GLB file in the scene's own folder; parsed by trimesh, distrusted before that.

A scene file may come from anybody. So its mesh must lie inside the scene's folder after every link is followed, its
header must not claim more than its bytes can hold, and nothing that the mesh file names in turn is ever opened.
"""

import io
import re
import stat
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np

from cases.mesh_headers import CLAIMS
from cases.scene import SceneError
from cases.scene_fields import shown

LARGEST = 256 * 2**20  # bytes of a mesh file
# Where an OBJ file has several materials, trimesh puts the faces of each together, the last material's first.
MATERIALS = re.compile(rb"^[ \t]*usemtl\b[^\n]*", re.MULTILINE)
MOST_TRIANGLES = 20_000_000  # after the instances of a GLB file are unfolded


def mesh_path(name: str, folder: Path | None) -> Path:
    """Return the real path of the mesh file `name` inside `folder`.

    Raises:
        SceneError: there is no folder, or `name` is absolute, leads outside, or names no regular file of a known kind.

    """
    if folder is None:
        raise SceneError(f"file cannot be read without a scene file to be relative to, got {shown(name)}")
    absolute = PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor
    if not name or absolute or not name.isprintable() or ".." in PurePosixPath(name.replace("\\", "/")).parts:
        raise SceneError(f"file must be a relative path inside the scene's folder, got {shown(name)}")
    if PurePosixPath(name).suffix.lower() not in CLAIMS:
        raise SceneError(f"file must end in one of {', '.join(CLAIMS)}, got {shown(name)}")
    try:
        path = (folder / name).resolve(strict=True)
        facts = path.stat()
    except FileNotFoundError:
        raise SceneError(f"file names no file: {shown(name)}") from None
    except (OSError, RuntimeError):  # a loop of links, a part that is no folder, no permission, too long a name
        raise SceneError(f"file cannot be opened: {shown(name)}") from None
    if not path.is_relative_to(folder.resolve()):
        raise SceneError(f"file must be a relative path inside the scene's folder, got a link out of it: {shown(name)}")
    if not stat.S_ISREG(facts.st_mode):
        raise SceneError(f"file must name a regular file, got {shown(name)}")
    if facts.st_size > LARGEST:
        raise SceneError(f"file must have at most {LARGEST} bytes, got {facts.st_size} bytes in {shown(name)}")
    return path


def read_mesh(name: str, folder: Path | None) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) float64 [m] and faces (m, 3) of the mesh file `name` in `folder`, in the file's order.

    The nodes of a GLB scene are placed by their transforms and joined.

    Raises:
        SceneError: the file may not or cannot be read, or has no triangles; the message begins with "file".

    """
    path = mesh_path(name, folder)
    suffix = PurePosixPath(name).suffix.lower()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise SceneError(f"file cannot be read: {error.strerror}: {shown(name)}") from None
    problem = CLAIMS[suffix](content)
    if problem:
        raise SceneError(f"file {problem}: {shown(name)}")
    if suffix == ".obj":
        content = MATERIALS.sub(b"", content)

    import trimesh  # here, because it takes most of a second and most scenes have no mesh file

    try:
        # From bytes and without a resolver: nothing that the file refers to can be opened.
        world = trimesh.load_scene(
            io.BytesIO(content), file_type=suffix[1:], process=False, maintain_order=True, skip_materials=True
        )
        triangles = sum(
            len(getattr(world.geometry[world.graph[node][1]], "faces", ())) for node in world.graph.nodes_geometry
        )
        if 0 < triangles <= MOST_TRIANGLES:
            mesh = world.to_mesh()
            return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    except Exception as error:
        reason = " ".join(shown(str(error))[1:-1].split()) or type(error).__name__
        raise SceneError(f"file cannot be understood as {suffix[1:].upper()} ({reason}): {shown(name)}") from None
    if triangles == 0:
        raise SceneError(f"file holds no triangles: {shown(name)}")
    raise SceneError(f"file must hold at most {MOST_TRIANGLES} triangles, got {triangles}: {shown(name)}")
