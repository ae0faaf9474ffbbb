"""Mesh files that a scene names (OBJ, PLY, STL, GLB): path and claimed size are checked, then they are read.

A scene file may come from anybody. So a mesh must lie inside the scene's folder after every link is followed, its
header must not claim more than its bytes can hold, and nothing that the mesh file names in turn is ever opened.
Sources: G. Turk, The PLY Polygon File Format (1994); 3D Systems, StereoLithography Interface Specification (1989);
Khronos, glTF 2.0 specification (2021), sections 3.6 and 4.4; Wavefront, Advanced Visualizer manual, appendix B1 (OBJ).
"""

import json
import os
import re
import stat
import struct
from collections.abc import Callable, Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np

from rayproof.cases.mesh_sandbox import BYTES_A_BYTE, FREE_BYTES, Budget, ForeignError, ask
from rayproof.cases.scene import SceneError, shown

LARGEST = 256 * 2**20  # bytes of a mesh file
LET_IN = "another one is let in by --allow-folder"
# What trimesh may take, beside its own code: a text file of 2 million triangles needs a third of it.
SECONDS, BYTES_A_SECOND = 6.0, 2**20
MEMORY, MEMORY_A_BYTE = 512 * 2**20, 40  # bytes
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes
GLB_COMPONENT = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes by componentType
GLB_COUNT = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def path_within(
    name: str, folder: Path, *, what: str, largest: int, kinds: tuple[str, ...] = (), beside: Path | None = None
) -> Path:
    """Return the real path of the regular file `name` in `beside` (default: `folder`), which lies inside `folder`.

    `kinds` are the endings that it may have (default: any).

    Raises:
        SceneError: it leads elsewhere, is no regular file, or has more than `largest` bytes; begins with `what`.

    """
    absolute = PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor
    if not name or absolute or not name.isprintable() or ".." in PurePosixPath(name.replace("\\", "/")).parts:
        raise SceneError(f"{what} must be a relative path inside the scene's folder, got {shown(name)}")
    if kinds and PurePosixPath(name).suffix.lower() not in kinds:
        raise SceneError(f"{what} must end in one of {', '.join(kinds)}, got {shown(name)}")
    try:
        path = ((beside or folder) / name).resolve(strict=True)
        facts = path.stat()
    except FileNotFoundError:
        raise SceneError(f"{what} names no file: {shown(name)}") from None
    except (OSError, RuntimeError):  # a loop of links, a part that is no folder, no permission, too long a name
        raise SceneError(f"{what} cannot be opened: {shown(name)}") from None
    if not path.is_relative_to(folder.resolve()):
        raise SceneError(
            f"{what} must be a relative path inside the scene's folder, got a link out of it: {shown(name)}"
        )
    if not stat.S_ISREG(facts.st_mode):
        raise SceneError(f"{what} must name a regular file, got {shown(name)}")
    if facts.st_size > largest:
        raise SceneError(f"{what} must have at most {largest} bytes, got {facts.st_size} bytes in {shown(name)}")
    return path


def is_plain(name: str) -> bool:
    """Say whether a name can be looked up at all: long and unprintable ones cannot."""
    return name.isprintable() and len(name) < 1000 and all(len(part) < 250 for part in Path(name).parts)


def located(name: str, folders: Sequence[Path], roots: Sequence[Path], what: str) -> tuple[Path, str]:
    """Return a folder and a name in it for the file `name`, looked for in `folders`.

    A name with `..` in it may lead into one of the `roots` and nowhere else. Whether the file is there, and may be
    opened, is left to `path_within`.

    Raises:
        SceneError: it leads elsewhere; the message begins with `what`.

    """
    beside = next((folder for folder in folders if is_plain(name) and (folder / name).is_file()), folders[0])
    if ".." not in Path(name).parts or not is_plain(name):
        return beside, name
    path = (beside / name).resolve()
    for root in roots:
        if path.is_relative_to(root.resolve()):
            return root, path.relative_to(root.resolve()).as_posix()
    raise SceneError(f"{what} must be a relative path inside the scene's folder, got {shown(name)}; {LET_IN}")


def content_of(path: Path, *, largest: int) -> bytes:
    """Return a regular file's bytes; what became of the path since it was looked at is refused, never waited for.

    Raises:
        OSError: it cannot be opened.
        SceneError: it is no regular file any more, or a larger one.

    """
    # A FIFO that took the file's place would be waited for without the flag.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        facts = os.fstat(file.fileno())
        if not stat.S_ISREG(facts.st_mode) or facts.st_size > largest:
            raise SceneError(f"{path.name} is no regular file of at most {largest} bytes any more")
        return file.read(largest + 1)[:largest]


# What a header claims, against the bytes that are there, before anything is allocated.


def _claim(what: str, claimed: int, present: int) -> str:
    return f"has a header that claims {what}, at least {claimed} bytes, where {present} are"


def _is_text_stl(content: bytes) -> bool:
    if len(content) >= STL_HEADER:  # some binary files begin with "solid", too
        (count,) = struct.unpack_from("<I", content, STL_HEADER - 4)
        if len(content) == STL_HEADER + STL_TRIANGLE * count:
            return False
    return content[:512].lstrip().lower().startswith(b"solid") and b"facet" in content[:4096].lower()


def stl_problem(content: bytes) -> str | None:
    """Return what is wrong with an STL file's header, or with the number of a text file's lines; or None."""
    if _is_text_stl(content):
        facets, vertices, ends = (
            len(re.findall(rb"^\s*" + word + rb"\b", content, re.MULTILINE | re.IGNORECASE))
            for word in (b"facet", b"vertex", b"endsolid")
        )
        if vertices != 3 * facets:
            return f"has {vertices} vertices in {facets} facets of three: it ends early, or holds polygons"
        return None if ends else f"ends early: no endsolid follows its {facets} facets"
    if len(content) < STL_HEADER:
        return "is no STL file: it is shorter than the header"
    (count,) = struct.unpack_from("<I", content, STL_HEADER - 4)
    claimed = STL_HEADER + STL_TRIANGLE * count
    return _claim(f"{count} triangles", claimed, len(content)) if claimed > len(content) else None


def _stl_content(content: bytes) -> tuple[bytes, tuple[str, ...]]:
    """Return a binary STL file up to its last triangle, and what it holds beside positions."""
    if _is_text_stl(content):
        return content, ()
    (count,) = struct.unpack_from("<I", content, STL_HEADER - 4)
    end = STL_HEADER + STL_TRIANGLE * count
    notes = [f"{len(content) - end} bytes after its {count} triangles"] if end < len(content) else []
    triangles = np.frombuffer(content, np.uint8, STL_TRIANGLE * count, STL_HEADER).reshape(-1, STL_TRIANGLE)
    coloured = int(triangles[:, -2:].any(axis=1).sum())
    notes += [f"the colours or attributes of {coloured} triangles"] if coloured else []
    return content[:end], tuple(notes)


def glb_problem(content: bytes) -> str | None:
    """Return what is wrong with a GLB file's header and its list of arrays, or None."""
    if len(content) < 20 or content[:4] != b"glTF":
        return "is no GLB file: it does not begin with glTF"
    _, version, length, chunk, kind = struct.unpack_from("<5I", content)
    if version != 2:
        return f"is glTF of version {version}, only 2 is read"
    if max(length, 20 + chunk) > len(content):
        return _claim("its length", max(length, 20 + chunk), len(content))
    if kind != 0x4E4F534A:
        return "is no GLB file: its first chunk is not JSON"
    try:
        document = json.loads(content[20 : 20 + chunk])
        claimed = sum(
            int(accessor["count"]) * GLB_COMPONENT[accessor["componentType"]] * GLB_COUNT[accessor["type"]]
            for accessor in document.get("accessors", ())
        )
        outside = [buffer["uri"] for buffer in document.get("buffers", ()) if "uri" in buffer]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
        return "has a JSON chunk that is not glTF"
    if outside:
        return "keeps data outside itself, which is never opened"
    # Arrays may overlap, so a little more than the file's size is honest; a hundred times as much is not.
    return _claim("its arrays", claimed, len(content)) if claimed > 100 * len(content) else None


KINDS = (".obj", ".ply", ".stl", ".glb")
CLAIMS: dict[str, Callable[[bytes], str | None]] = {".stl": stl_problem, ".glb": glb_problem}


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
    suffix = PurePosixPath(name).suffix.lower()
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"file cannot be read: {error.strerror}: {shown(name)}") from None
    budget.count_file(path, len(content))
    if suffix == ".stl" and _is_text_stl(content):
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    problem = CLAIMS[suffix](content) if suffix in CLAIMS else None
    if problem:
        raise SceneError(f"file {problem}: {shown(name)}")
    notes: tuple[str, ...] = ()
    if suffix == ".stl":
        content, notes = _stl_content(content)
    try:
        facts, arrays = ask(
            "rayproof.cases.mesh_sandbox:mesh_parser",
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
    budget.notes[path] = (*notes, *facts.get("notes", ()))
    # Where there are too many, nothing but their number came back.
    budget.spend("triangles", 0 if arrays else facts["triangles"], by=f"file {shown(name)}")
    numbers = 3 * facts["vertices"]
    vertices = np.frombuffer(arrays, np.float64, numbers).reshape(-1, 3)
    return vertices, np.frombuffer(arrays, np.int64, offset=8 * numbers).reshape(-1, 3)
