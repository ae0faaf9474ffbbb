"""glTF 2.0 documents (Khronos 2021) read and checked: objects, buffers, accessors, placed nodes.

The document is GLB, or JSON with data URIs or files in its own folder; nothing else is opened. Objects are classes with
the members that are used. A file may contain anything, so the reader of a member checks its value. Section numbers are
those of the specification.
"""

import base64
import binascii
import json
import struct
from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypedDict, TypeVar
from urllib.parse import unquote

import numpy as np
from scipy.spatial.transform import Rotation

from rayproof.cases.foreign_files import Budget, content_of, path_within
from rayproof.cases.scene import SceneError, shown


class Root(TypedDict, total=False):
    """The document itself (section 5.17), without its lists of the objects below."""

    scene: int
    extensionsRequired: list[str]
    extensionsUsed: list[str]
    extensions: dict[str, Any]  # KHR_lights_punctual: all lights, with type, name, intensity [cd], color and range


class SceneEntry(TypedDict, total=False):
    """A scene: its root nodes."""

    nodes: list[int]


class NodeEntry(TypedDict, total=False):
    """A node: its mesh, children and transform."""

    name: str
    children: list[int]
    mesh: int
    camera: int
    matrix: list[float]  # by columns
    rotation: list[float]  # x, y, z, w
    scale: list[float]
    translation: list[float]
    extensions: dict[str, Any]  # KHR_lights_punctual: the index of the node's light


class CameraEntry(TypedDict, total=False):
    """A camera."""

    type: str
    perspective: dict[str, float]  # yfov [rad], znear, zfar, aspectRatio


class PrimitiveEntry(TypedDict, total=False):
    """A part of a mesh with one material."""

    mode: int
    attributes: dict[str, int]  # accessors
    indices: int
    material: int
    extensions: Collection[str]


class MeshEntry(TypedDict, total=False):
    """A mesh."""

    name: str
    primitives: list[PrimitiveEntry]


class MaterialEntry(TypedDict, total=False):
    """A material."""

    pbrMetallicRoughness: dict[str, Any]  # baseColorFactor, metallicFactor
    emissiveFactor: list[float]
    alphaMode: str
    doubleSided: bool
    extensions: Collection[str]


class AccessorEntry(TypedDict, total=False):
    """A typed array in a buffer view."""

    type: str
    componentType: int
    count: int
    bufferView: int
    byteOffset: int
    normalized: bool
    sparse: dict[str, Any]


class BufferViewEntry(TypedDict, total=False):
    """A part of a buffer."""

    buffer: int
    byteOffset: int
    byteStride: int


class BufferEntry(TypedDict, total=False):
    """Bytes, here or in a file."""

    byteLength: int
    uri: str


class AnimationEntry(TypedDict, total=False):
    """An animation, which is ignored."""


Entry = TypeVar("Entry")
LISTS: dict[type, str] = {
    SceneEntry: "scenes",
    NodeEntry: "nodes",
    CameraEntry: "cameras",
    MeshEntry: "meshes",
    MaterialEntry: "materials",
    AccessorEntry: "accessors",
    BufferViewEntry: "bufferViews",
    BufferEntry: "buffers",
    AnimationEntry: "animations",
}


# A glTF document and its buffers: GLB or JSON with data URIs or files of its own folder; nothing else is opened.


LARGEST = 512 * 2**20  # bytes, of the file and of each buffer
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


@dataclass(frozen=True, kw_only=True)
class Document:
    """The JSON part, the bytes of each buffer, and the remaining budget."""

    json: Root
    buffers: tuple[memoryview, ...]
    budget: Budget = field(default_factory=Budget)

    def listed(self, kind: type[Entry]) -> list[Entry]:
        """Return the document's top-level list of a kind; empty if it has none."""
        entries = self.json.get(LISTS[kind], [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise SceneError(f"{LISTS[kind]} must be a list of objects")
        return entries

    def one(self, kind: type[Entry], index: Any) -> Entry:
        """Return the entry of a list that an index names; raise SceneError if there is none."""
        entries = self.listed(kind)
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise SceneError(f"{LISTS[kind]} has {len(entries)} entries, none at {shown(index)}")
        return entries[index]


GLB_COMPONENT = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes by componentType
GLB_COUNT = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def _claim(what: str, claimed: int, present: int) -> str:
    return f"has a header that claims {what}, at least {claimed} bytes, where {present} are"


def glb_problem(content: bytes) -> str | None:
    """Return a sentence on a mistake in a GLB file's header or list of chunks, or None."""
    if len(content) < 20 or content[:4] != b"glTF":
        return "is no GLB file: it does not begin with glTF"
    _, version, length, chunk, kind = struct.unpack_from("<5I", content)
    if version != 2:
        return f"is glTF of version {version}, only 2 is read"
    if max(length, 20 + chunk) > len(content):
        return _claim("its length", max(length, 20 + chunk), len(content))
    if kind != JSON_CHUNK:
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
    # Arrays may overlap, so a little more than the file's size is plausible; a hundred times as much is not.
    return _claim("its arrays", claimed, len(content)) if claimed > 100 * len(content) else None


def read_document(path: Path) -> Document:
    """Return the document in a .glb or .gltf file.

    Raises:
        SceneError: it is too large, cut off, not glTF 2.0, or keeps data outside its own folder.

    """
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"cannot be read: {error.strerror}") from None
    budget = Budget()
    budget.count_file(path, len(content))
    if path.suffix.lower() == ".glb":
        return glb_document(content, path.parent, budget)
    return _document(content, b"", path.parent, budget)


def glb_document(content: bytes, folder: Path, budget: Budget) -> Document:
    """Return the document in a GLB file's content; raise SceneError if it is cut off or not glTF 2.0."""
    problem = glb_problem(content)
    if problem:
        raise SceneError(problem)
    (length,) = struct.unpack_from("<I", content, 12)
    text, rest, binary = content[20 : 20 + length], content[20 + length :], b""
    if len(rest) >= 8:
        size, kind = struct.unpack_from("<II", rest)
        binary = rest[8 : 8 + size] if kind == BINARY_CHUNK else b""
    return _document(text, binary, folder, budget)


def _document(text: bytes, binary: bytes, folder: Path, budget: Budget) -> Document:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise SceneError("is not glTF: its JSON cannot be read") from None
    if (version := _version(document)) is None or not str(version).startswith("2."):
        raise SceneError(f"must be glTF of version 2, got {shown(version)}")
    whole = Document(json=document, buffers=())
    # The binary chunk is that of the first buffer (section 4.4.3.3); any other buffer without a uri is empty.
    files = _Files(folder, budget)
    buffers = tuple(
        _buffer(buffer, files, b"" if index else binary) for index, buffer in enumerate(whole.listed(BufferEntry))
    )
    return Document(json=document, buffers=buffers, budget=budget)


def _version(document: Any) -> Any:
    return document.get("asset", {}).get("version") if isinstance(document, dict) else None


class _Files:
    """The files that buffers name, each read only once."""

    def __init__(self, folder: Path, budget: Budget) -> None:
        self._folder, self._budget = folder, budget
        # By the written uri, so that an alias of a file counts as a second file in memory.
        self.content = cache(self._read)

    def _read(self, uri: str) -> bytes:
        """Return the bytes of the file that a uri names, inside the folder."""
        what = "a buffer's uri"
        if ":" in uri:
            raise SceneError(f"{what} must be a relative path, got {shown(uri)}")
        path = path_within(unquote(uri), self._folder, what=what, largest=LARGEST)
        try:
            content = content_of(path, largest=LARGEST)
        except OSError as error:
            raise SceneError(f"{what} names a file that cannot be read: {error.strerror}: {shown(uri)}") from None
        self._budget.count_file(path, len(content))
        self._budget.expand(len(content), by=f"{what} {shown(uri)}")
        return content


def _buffer(buffer: BufferEntry, files: _Files, binary: bytes) -> memoryview:
    """Return a buffer's bytes (section 3.6.1)."""
    length, uri = buffer.get("byteLength"), buffer.get("uri")
    if not isinstance(length, int) or not 0 <= length <= LARGEST:
        raise SceneError(f"a buffer's byteLength must be from 0 to {LARGEST}, got {shown(length)}")
    if uri is None:
        content = binary
    elif isinstance(uri, str) and uri.startswith("data:"):
        head, _, body = uri.partition(",")
        if not head.endswith(";base64"):
            raise SceneError("a buffer's data URI must be base64")
        try:
            content = base64.b64decode(body, validate=True)
        except (ValueError, binascii.Error):
            raise SceneError("a buffer's data URI is not base64") from None
    elif isinstance(uri, str):
        content = files.content(uri)
    else:
        raise SceneError(f"a buffer's uri must be a text, got {shown(uri)}")
    if len(content) < length:
        raise SceneError(f"a buffer has {len(content)} bytes, {length} were announced")
    return memoryview(content)[:length]


# Typed arrays out of a glTF document's buffers (sections 3.6.1 and 3.6.2), checked against the bytes there are.


COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COUNTS = {"SCALAR": 1, "VEC3": 3}


def array(document: Document, index: Any, kind: str) -> np.ndarray:
    """Return an accessor's elements, shape (count, components), in the file's own type; normalized ones as float64.

    Raises:
        SceneError: the accessor is compressed, of another kind, or reaches beyond its bytes.

    """
    accessor = document.one(AccessorEntry, index)
    if accessor.get("type") != kind or kind not in COUNTS:
        raise SceneError(f"accessor {index} must be {kind}, got {shown(accessor.get('type'))}")
    if accessor.get("componentType") not in COMPONENTS:
        raise SceneError(f"accessor {index} has no known componentType: {shown(accessor.get('componentType'))}")
    element = np.dtype(COMPONENTS[accessor["componentType"]])
    components, count = COUNTS[kind], _whole(accessor, "count", index)
    document.budget.expand(count * components * element.itemsize, by=f"accessor {shown(index)} of {count} elements")
    if "bufferView" not in accessor:
        return _substituted(document, accessor, index, np.zeros((count, components), dtype=element))
    view = document.one(BufferViewEntry, accessor["bufferView"])
    buffer = _buffer_of(document, view)
    start = _whole(view, "byteOffset", index, 0) + _whole(accessor, "byteOffset", index, 0)
    stride = _whole(view, "byteStride", index, element.itemsize * components)
    end = start + stride * (count - 1) + element.itemsize * components if count else start
    if end > len(buffer) or stride < element.itemsize * components:
        raise SceneError(f"accessor {index} reaches to byte {end} of {len(buffer)}")
    values = np.ndarray((count, components), element, buffer, start, (stride, element.itemsize)).copy()
    values = _substituted(document, accessor, index, values)
    stands_for_fractions = accessor.get("normalized") is True and element.kind in "iu" and kind != "SCALAR"
    if stands_for_fractions:
        document.budget.expand(8 * values.size, by=f"accessor {shown(index)}, normalized,")
        return _fractions(values)
    return values


def _substituted(document: Document, accessor: AccessorEntry, index: Any, values: np.ndarray) -> np.ndarray:
    """Return an accessor's elements after its sparse substitutions (section 3.6.2.3)."""
    sparse = accessor.get("sparse")
    if sparse is None:
        return values
    count, places, replaced = sparse["count"], sparse["indices"], sparse["values"]
    if not isinstance(count, int) or not 0 < count <= len(values):
        raise SceneError(f"accessor {index}: sparse.count must be from 1 to {len(values)}, got {shown(count)}")
    if places.get("componentType") not in (5121, 5123, 5125):
        raise SceneError(f"accessor {index}: sparse indices have no known componentType")
    rows = _packed(document, places, index, np.dtype(COMPONENTS[places["componentType"]]), (count,))
    if (rows >= len(values)).any():
        raise SceneError(f"accessor {index}: a sparse index is {int(rows.max())}, where {len(values)} elements are")
    values[rows.astype(np.int64)] = _packed(document, replaced, index, values.dtype, (count, values.shape[1]))
    return values


def _packed(document: Document, part: Any, index: Any, element: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Return the indices or values of a sparse accessor, which are stored without gaps."""
    view = document.one(BufferViewEntry, part.get("bufferView"))
    buffer = _buffer_of(document, view)
    start = _whole(view, "byteOffset", index, 0) + _whole(part, "byteOffset", index, 0)
    end = start + int(np.prod(shape)) * element.itemsize
    if end > len(buffer):
        raise SceneError(f"accessor {index}: its sparse part reaches to byte {end} of {len(buffer)}")
    return np.ndarray(shape, element, buffer, start)


def _fractions(whole: np.ndarray) -> np.ndarray:
    """Return the values of normalized integers: the largest is 1; the least and the next one are -1 (3.11)."""
    return np.maximum(whole / float(np.iinfo(whole.dtype).max), -1.0)


def _buffer_of(document: Document, view: BufferViewEntry) -> memoryview:
    index = view.get("buffer")
    if not isinstance(index, int) or not 0 <= index < len(document.buffers):
        raise SceneError(f"a buffer view names no buffer: {shown(index)}")
    return document.buffers[index]


def _whole(members: AccessorEntry | BufferViewEntry, name: str, index: Any, usual: int | None = None) -> int:
    value = members.get(name, usual)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise SceneError(f"accessor {index}: {name} must be a whole number >= 0, got {shown(value)}")
    return value


# A glTF scene's nodes with their matrices to the world (section 3.5).


def placed_nodes(document: Document) -> list[tuple[NodeEntry, np.ndarray]]:
    """Return each node of the default scene with its matrix to the world, float64 (4, 4).

    The primitives of their meshes are counted as shapes before any is built: every node may name the same mesh.

    Raises:
        SceneError: a node has two parents or is its own ancestor, its numbers are no transform, or there are too many.

    """
    if document.listed(SceneEntry):
        roots = document.one(SceneEntry, document.json.get("scene", 0)).get("nodes", [])
    else:  # a library of objects (section 3.5.1): all nodes that are no other node's children
        nodes = document.listed(NodeEntry)
        held = {child for node in nodes for child in node.get("children", [])}
        roots = [index for index in range(len(nodes)) if index not in held]
    waiting = [(index, np.eye(4)) for index in reversed(roots)]
    visited: set[int] = set()
    placed: list[tuple[NodeEntry, np.ndarray]] = []
    while waiting:
        index, outer = waiting.pop()
        node = document.one(NodeEntry, index)
        if index in visited:
            raise SceneError(f"node {index} has two parents, or is its own ancestor")
        visited.add(index)
        document.budget.spend("elements", 1, by=f"node {index}")
        to_world = outer @ _local(node, index)
        placed.append((node, to_world))
        waiting += [(child, to_world) for child in reversed(node.get("children", []))]
    named = [document.one(MeshEntry, node["mesh"]) for node, _ in placed if "mesh" in node]
    document.budget.spend("shapes", sum(len(mesh.get("primitives", [])) for mesh in named), by="it with all its nodes")
    return placed


def _local(node: NodeEntry, index: int) -> np.ndarray:
    """Return a node's matrix: given by columns, or translation times rotation times scale (section 3.5.3)."""
    if "matrix" in node:
        return _numbers(node["matrix"], 16, index).reshape(4, 4).T
    matrix = np.eye(4)
    turn = _numbers(node.get("rotation", (0, 0, 0, 1)), 4, index)
    if not np.linalg.norm(turn) > 0:
        raise SceneError(f"node {index}: the rotation must not be zero")
    rotation = Rotation.from_quat(turn).as_matrix()  # x, y, z, w, of any length
    matrix[:3, :3] = rotation * _numbers(node.get("scale", (1, 1, 1)), 3, index)
    matrix[:3, 3] = _numbers(node.get("translation", (0, 0, 0)), 3, index)
    return matrix


def _numbers(values: Any, count: int, index: int) -> np.ndarray:
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,):
        raise SceneError(f"node {index}: {count} numbers are needed, got {shown(values)}")
    return numbers
