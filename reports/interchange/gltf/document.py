"""A glTF document and its buffers: GLB or JSON with data URIs or files of its own folder; nothing else is opened."""

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from rayproof.cases.mesh_files import content_of, glb_problem, path_within
from rayproof.cases.mesh_sandbox import Budget
from rayproof.cases.scene import SceneError, shown
from rayproof.reports.interchange.gltf.entries import LISTS, BufferEntry, Entry, Root

LARGEST = 512 * 2**20  # bytes, of the file and of each buffer
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


@dataclass(frozen=True, kw_only=True)
class Document:
    """The JSON part, the bytes of each buffer, and what may still be spent on them."""

    json: Root
    buffers: tuple[memoryview, ...]
    budget: Budget = field(default_factory=Budget)

    def listed(self, kind: type[Entry]) -> list[Entry]:
        """Return the document's top-level list of a kind; empty where it has none."""
        found = self.json.get(LISTS[kind], [])
        if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
            raise SceneError(f"{LISTS[kind]} must be a list of objects")
        return found

    def one(self, kind: type[Entry], index: Any) -> Entry:
        """Return the entry of a list that an index names; raise SceneError if there is none."""
        entries = self.listed(kind)
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise SceneError(f"{LISTS[kind]} has {len(entries)} entries, none at {shown(index)}")
        return entries[index]


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
    binary = b""
    if path.suffix.lower() == ".glb":
        problem = glb_problem(content)
        if problem:
            raise SceneError(problem)
        (length,) = struct.unpack_from("<I", content, 12)
        text, rest = content[20 : 20 + length], content[20 + length :]
        if len(rest) >= 8:
            size, kind = struct.unpack_from("<II", rest)
            binary = rest[8 : 8 + size] if kind == BINARY_CHUNK else b""
    else:
        text = content
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise SceneError("is not glTF: its JSON cannot be read") from None
    if (version := _version(document)) is None or not str(version).startswith("2."):
        raise SceneError(f"must be glTF of version 2, got {shown(version)}")
    found = Document(json=document, buffers=())
    # The binary chunk is that of the first buffer (section 4.4.3.3); any other without a uri holds nothing.
    files = _Files(path.parent, budget)
    buffers = tuple(
        _buffer(buffer, files, b"" if index else binary) for index, buffer in enumerate(found.listed(BufferEntry))
    )
    return Document(json=document, buffers=buffers, budget=budget)


def _version(document: Any) -> Any:
    return document.get("asset", {}).get("version") if isinstance(document, dict) else None


class _Files:
    """The files that buffers name, each read once however many name it."""

    def __init__(self, folder: Path, budget: Budget) -> None:
        self._folder, self._budget = folder, budget
        self._contents: dict[str, bytes] = {}

    def content(self, uri: str) -> bytes:
        """Return the bytes of the file that a uri names, inside the folder."""
        what = "a buffer's uri"
        if uri not in self._contents:
            if ":" in uri:
                raise SceneError(f"{what} must be a relative path, got {shown(uri)}")
            path = path_within(unquote(uri), self._folder, what=what, largest=LARGEST)
            try:
                content = content_of(path, largest=LARGEST)
            except OSError as error:
                raise SceneError(f"{what} names a file that cannot be read: {error.strerror}: {shown(uri)}") from None
            # By what it is written, so that an alias of a file counts as often as it is held.
            self._budget.count_file(path, len(content))
            self._budget.expand(len(content), by=f"{what} {shown(uri)}")
            self._contents[uri] = content
        return self._contents[uri]


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
