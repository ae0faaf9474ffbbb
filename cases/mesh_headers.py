"""What a mesh file's header claims against the bytes that are there, checked before anything is allocated.

Sources: G. Turk, The PLY Polygon File Format (1994); 3D Systems, StereoLithography Interface Specification (1989);
Khronos, glTF 2.0 specification (2021), sections 3.6 and 4.4; Wavefront, Advanced Visualizer manual, appendix B1 (OBJ).
"""

import json
import re
import struct
from collections.abc import Callable

PLY_HEADER = 2**16  # bytes within which a PLY header must end
PLY_SIZES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1,
    "short": 2, "ushort": 2, "int16": 2, "uint16": 2,
    "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4,
    "double": 8, "float64": 8,
}  # fmt: skip
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes
VERTEX_ZERO = re.compile(rb"\n[ \t]*f[ \t][^\n]*?(?<=[ \t])0+(?=[/\s]|\Z)")  # trimesh would take it for the first
GLB_COMPONENT = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes by componentType
GLB_COUNT = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def _claim(what: str, claimed: int, present: int) -> str:
    return f"has a header that claims {what}, at least {claimed} bytes, where {present} are"


def ply_problem(content: bytes) -> str | None:
    """Return what is wrong with a PLY file's header, or None."""
    head, found, _ = content[:PLY_HEADER].partition(b"end_header")
    if not head.startswith(b"ply") or not found:
        return "is no PLY file: its header does not begin with ply and end with end_header"
    present = len(content) - len(head) - len(found)
    is_text = b"format ascii" in head
    needed, claims = 0, []
    count = 0
    for line in head.decode("ascii", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["element"]:
            if len(words) != 3 or not words[2].isascii() or not words[2].isdigit() or len(words[2]) > 18:
                return "has a header with an element that is not counted"
            count = int(words[2])
            claims.append(f"{count} {words[1][:20]}" if words[1].isalnum() else f"{count} elements")
        elif words[:1] == ["property"]:
            # A list holds at least its length; a number in text at least a digit and a separator.
            kind = words[2 if words[1:2] == ["list"] else 1] if len(words) > 2 else ""
            if kind not in PLY_SIZES:
                return "has a header with a property of no known type"
            needed += count * (2 if is_text else PLY_SIZES[kind])
    # The last separator of a text file may be missing.
    return _claim(" and ".join(claims), needed, present) if needed > present + 1 else None


def stl_problem(content: bytes) -> str | None:
    """Return what is wrong with an STL file's header, or None; a text file claims nothing."""
    if content[:512].lstrip().lower().startswith(b"solid") and b"facet" in content[:4096].lower():
        return None
    if len(content) < STL_HEADER:
        return "is no STL file: it is shorter than the header"
    (count,) = struct.unpack_from("<I", content, STL_HEADER - 4)
    claimed = STL_HEADER + STL_TRIANGLE * count
    if claimed > len(content):
        return _claim(f"{count} triangles", claimed, len(content))
    return None if claimed == len(content) else f"has {len(content) - claimed} bytes after its {count} triangles"


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


def obj_problem(content: bytes) -> str | None:
    """Return what is wrong with an OBJ file before it is parsed: it has no header, but is text, and counts from 1."""
    if b"\0" in content:
        return "is no OBJ file: it holds zero bytes"
    return "has a face that names vertex 0, where counting begins at 1" if VERTEX_ZERO.search(content) else None


CLAIMS: dict[str, Callable[[bytes], str | None]] = {
    ".obj": obj_problem,
    ".ply": ply_problem,
    ".stl": stl_problem,
    ".glb": glb_problem,
}
