"""A glTF document and its buffers: GLB or JSON with data URIs or files of its own folder; nothing else is opened."""

import base64
import binascii
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from cases.mesh_headers import glb_problem
from cases.scene import SceneError
from cases.scene_fields import shown

LARGEST = 512 * 2**20  # bytes, of the file and of each buffer
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


@dataclass(frozen=True, kw_only=True)
class Document:
    """The JSON part, and the bytes of each buffer."""

    json: dict[str, Any]
    buffers: tuple[bytes, ...]

    def listed(self, kind: str) -> list[dict[str, Any]]:
        """Return the document's top-level list of a kind; empty where it has none."""
        found = self.json.get(kind, [])
        if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
            raise SceneError(f"{kind} must be a list of objects")
        return found

    def one(self, kind: str, index: Any) -> dict[str, Any]:
        """Return the entry of a list that an index names; raise SceneError if there is none."""
        entries = self.listed(kind)
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise SceneError(f"{kind} has {len(entries)} entries, none at {shown(index)}")
        return entries[index]


def read_document(path: Path) -> Document:
    """Return the document in a .glb or .gltf file.

    Raises:
        SceneError: it is too large, cut off, not glTF 2.0, or keeps data outside its own folder.

    """
    if path.stat().st_size > LARGEST:
        raise SceneError(f"must have at most {LARGEST} bytes, got {path.stat().st_size}")
    content = path.read_bytes()
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
    version = document.get("asset", {}).get("version") if isinstance(document, dict) else None
    if version is None or not str(version).startswith("2."):
        raise SceneError(f"must be glTF of version 2, got {shown(version)}")
    found = Document(json=document, buffers=())
    # The binary chunk is that of the first buffer (section 4.4.3.3); any other without a uri holds nothing.
    buffers = enumerate(found.listed("buffers"))
    return Document(
        json=document,
        buffers=tuple(_buffer(buffer, path.parent, b"" if index else binary) for index, buffer in buffers),
    )


def _buffer(buffer: dict[str, Any], folder: Path, binary: bytes) -> bytes:
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
    else:
        content = _file(uri, folder)
    if len(content) < length:
        raise SceneError(f"a buffer has {len(content)} bytes, {length} were announced")
    return content[:length]


def _file(uri: Any, folder: Path) -> bytes:
    name = unquote(uri) if isinstance(uri, str) else ""
    if not name or "\0" in name or ":" in name:
        raise SceneError(f"a buffer's uri must be a relative path, got {shown(uri)}")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise SceneError(f"a buffer's uri must stay inside the file's folder, got {shown(uri)}")
    if not path.is_file() or path.stat().st_size > LARGEST:
        raise SceneError(f"a buffer's uri names no file that can be read: {shown(uri)}")
    return path.read_bytes()
