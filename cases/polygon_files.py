"""The readers of OBJ and PLY, in text and binary: vertices and polygons in the file's order.

They allocate memory only in proportion to the file's size, and name the line of an error. Sources: Wavefront, Advanced
Visualizer manual, appendix B1 (OBJ); G. Turk, The PLY Polygon File Format (1994).
"""

import io
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from rayproof.cases.polygons import PolygonMesh, triangles_of

SCALARS = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1",
    "short": "i2", "ushort": "u2", "int16": "i2", "uint16": "u2",
    "int": "i4", "uint": "u4", "int32": "i4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
FLOATS = ("f4", "f8")
LARGEST = float(np.finfo(np.float32).max)  # of a coordinate: meshes are stored in float32
CORNERS = ("vertex_indices", "vertex_index")
LINE_END = re.compile(rb"\r\n|\r|\n")
Row = dict[str, np.ndarray]


def obj_mesh(content: bytes) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return vertices [m], triangles and sentences about an OBJ file, in the form of `mesh_files.READERS`.

    Raises:
        ValueError: the file is broken, has no triangle, or has a polygon that crosses itself; the message is a
        sentence.

    """
    polygons = read_obj(content)
    return polygons.vertices, *triangles_of(polygons)


def ply_mesh(content: bytes) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return the same for a PLY file; raise ValueError in the same cases."""
    polygons = read_ply(content)
    return polygons.vertices, *triangles_of(polygons)


# OBJ


def read_obj(content: bytes) -> PolygonMesh:
    """Return the vertices and faces of an OBJ file, negative indices counted back from the vertices so far."""
    if b"\0" in content:
        raise ValueError("is no OBJ file: it holds zero bytes")
    # The byte-order mark of UTF-8 would hide the first statement.
    content = content.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    vertices: list[float] = []
    polygons = PolygonMesh(vertices=np.empty((0, 3)))
    continued, first = b"", 0
    # Line by line: a list of all lines takes twenty times the memory of the file if lines are short.
    for number, line in enumerate(chain(io.BytesIO(content), (b"",)), 1):
        line = line.removesuffix(b"\n")
        if line.endswith(b"\\"):
            continued, first = continued + line[:-1] + b" ", first or number
            continue
        if continued:
            line, number, continued, first = continued + line, first, b"", 0
        words = (line.split(b"#", 1)[0] if b"#" in line else line).split()
        if not words:
            continue
        statement = words[0]
        if statement == b"v":
            if len(words) < 4:
                raise ValueError(f"line {number}: a vertex needs three coordinates, got {len(words) - 1}")
            vertices += (coordinate(words[1], number), coordinate(words[2], number), coordinate(words[3], number))
        elif statement == b"f":
            _add_face(polygons, words[1:], len(vertices) // 3, number)
        elif statement in (b"l", b"p"):
            polygons.others["lines" if statement == b"l" else "points"] += 1
    polygons.vertices = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    return polygons


def _add_face(polygons: PolygonMesh, words: Sequence[bytes], count: int, line: int) -> None:
    corners = []
    for word in words:
        text = word.split(b"/", 1)[0]
        try:
            index = int(text)
        except ValueError:
            index = 0
        if not 0 < abs(index) < 2**31 or b"_" in text:
            raise ValueError(f"line {line}: a face names vertices by numbers from 1 or back from -1, got {_text(word)}")
        if index < -count:
            raise ValueError(f"line {line}: a face counts back {-index} vertices, where {count} are before it")
        corners.append(index - 1 if index > 0 else count + index)
    polygons.add(corners, line)


def coordinate(word: bytes, line: int) -> float:
    """Return the coordinate in a word of a text file; raise ValueError if it is not finite in float32."""
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not abs(value) <= LARGEST or b"_" in word:
        raise ValueError(f"line {line}: a coordinate must be a finite number, got {_text(word)}")
    return value


def _text(word: bytes) -> str:
    return repr(word[:40].decode("ascii", errors="replace"))


# PLY


@dataclass(frozen=True, kw_only=True)
class PlyProperty:
    """A property of a PLY element: a number, or a list with a number of entries before them."""

    name: str
    kind: str  # as NumPy names it
    length: str | None  # of a list: the type of its length


@dataclass(frozen=True, kw_only=True)
class PlyElement:
    """An element of a PLY file."""

    name: str
    count: int
    properties: list[PlyProperty]


def read_ply(content: bytes) -> PolygonMesh:
    """Return the vertices, faces and triangle strips of a PLY file in text or in binary."""
    layout, elements, start = ply_header(content)
    polygons = PolygonMesh(vertices=np.empty((0, 3)), place="face")
    lines: list[bytes] = []
    if layout == "":
        lines = [line for line in LINE_END.split(content[start:]) if line.strip()]
        lines = [line for line in lines if not line.lstrip().startswith((b"comment", b"obj_info"))]
    for element in elements:
        if layout == "":
            if len(lines) < element.count:
                raise ValueError(f"announces {element.count} of its element {element.name!r}, holds {len(lines)}")
            rows, lines = lines[: element.count], lines[element.count :]
            columns = _text_columns(element, rows)
        else:
            columns, start = _binary_columns(element, content, start, layout)
        if element.name == "vertex":
            polygons.vertices = _positions(columns)
        elif element.name in ("face", "tristrips"):
            _add_rows(polygons, element, columns)
        else:
            polygons.others[f"elements {element.name!r}"] += element.count
    if rest := len(content) - start if layout else len(lines):
        polygons.notes.append(f"{rest} {'bytes' if layout else 'lines'} after its last element")
    return polygons


def ply_header(content: bytes) -> tuple[str, list[PlyElement], int]:
    """Return "<", ">" or "" for text, the elements, and the offset of the body."""
    layouts = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
    layout: str | None = None
    elements: list[PlyElement] = []
    position = 0
    for match in LINE_END.finditer(content[: 2**20]):
        line, position, before = content[position : match.start()], match.end(), position
        words = line.split()
        if before == 0 and words != [b"ply"]:
            break
        if words[:1] == [b"end_header"]:
            if layout is None:
                raise ValueError("has a header without a format")
            return layout, elements, position
        if words[:1] == [b"format"]:
            layout = layouts.get(words[1] if len(words) > 1 else b"")
            if layout is None:
                raise ValueError(f"has a format that is not known: {_text(line)}")
        elif words[:1] == [b"element"]:
            if len(words) != 3 or not words[2].isdigit() or len(words[2]) > 18:
                raise ValueError(f"has a header with an element that is not counted: {_text(line)}")
            name = words[1].decode("ascii", "replace")
            if not name.isprintable():
                raise ValueError(f"has a header with an element of no readable name: {_text(line)}")
            elements.append(PlyElement(name=name, count=int(words[2]), properties=[]))
        elif words[:1] == [b"property"]:
            names = [word.decode("ascii", "replace") for word in words[1:]]
            is_list = names[:1] == ["list"]
            kinds = [SCALARS.get(name) for name in (names[1:-1] if is_list else names[:-1])]
            if not elements or len(kinds) != (2 if is_list else 1) or None in kinds or (is_list and kinds[0] in FLOATS):
                raise ValueError(f"has a header with a property of no known type: {_text(line)}")
            length = kinds[0] if is_list else None
            elements[-1].properties.append(PlyProperty(name=names[-1], kind=str(kinds[-1]), length=length))
        elif words and words[0] not in (b"ply", b"comment", b"obj_info"):
            raise ValueError(f"has a header with a line of no known kind: {_text(line)}")
    raise ValueError("is no PLY file: its header does not begin with ply and end with end_header")


def _text_columns(element: PlyElement, rows: list[bytes]) -> Row:
    """Return each property's values, and for a list property its lengths, its entries in sequence and its rows."""
    if rows and not any(prop.length for prop in element.properties):
        words = b" ".join(rows).split()
        width = len(element.properties)
        if len(words) != width * len(rows):
            row = next(row for row, line in enumerate(rows) if len(line.split()) != width)
            count = len(rows[row].split())
            raise ValueError(f"{element.name} {row}: the header announces {width} numbers, the line holds {count}")
        table = _numbers(words, element.name).reshape(-1, width)
        return {prop.name: _rounded(table[:, at], prop.kind) for at, prop in enumerate(element.properties)}
    gathered: dict[str, list[bytes]] = {prop.name: [] for prop in element.properties}
    lengths: dict[str, list[int]] = {prop.name: [] for prop in element.properties if prop.length}
    for row, line in enumerate(rows):
        words, at = line.split(), 0
        for prop in element.properties:
            length = 1
            if prop.length:
                length = int(words[at]) if at < len(words) and words[at][:20].isdigit() and len(words[at]) < 20 else -1
                at += 1
                lengths[prop.name].append(length)
            if not 0 <= length <= len(words) - at:
                raise ValueError(f"{element.name} {row}: announces more entries than its line has: {_text(line)}")
            gathered[prop.name] += words[at : at + length]
            at += length
        if at != len(words):
            raise ValueError(f"{element.name} {row}: has {len(words) - at} numbers more than the header announces")
    kinds = {prop.name: prop.kind for prop in element.properties}
    columns = {name: _rounded(_numbers(words, element.name), kinds[name]) for name, words in gathered.items()}
    return columns | {f"{name}#": np.array(counts, dtype=np.int64) for name, counts in lengths.items()}


def _numbers(words: list[bytes], what: str) -> np.ndarray:
    try:
        # Not by an array of words, all of which would have the longest word's width.
        return np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        raise ValueError(f"{what}: holds something that is no number") from None


def _rounded(values: np.ndarray, kind: str) -> np.ndarray:
    """Return numbers in text, rounded to the type that the header declares: `float` has 24 bits."""
    with np.errstate(over="ignore"):
        return values.astype(kind) if kind in FLOATS else values


def _binary_columns(element: PlyElement, content: bytes, start: int, order: str) -> tuple[Row, int]:
    """Return the same for a binary body, and the offset of its end."""
    lists = [prop for prop in element.properties if prop.length]
    sizes = [np.dtype(prop.length or prop.kind).itemsize for prop in element.properties]
    left = len(content) - start
    if element.count * sum(sizes) > left:
        raise ValueError(
            f"announces {element.count} of its element {element.name!r}, at least {element.count * sum(sizes)} bytes, "
            f"where {left} are left"
        )
    if not lists or not element.count:
        table = _table(element, [0] * len(lists), order)
        rows = np.frombuffer(content, table, element.count, start)
        columns = {prop.name: rows[f"{place}"] for place, prop in enumerate(element.properties) if not prop.length}
        nothing = np.empty(0, np.int64)
        return columns | {name: nothing for prop in lists for name in (prop.name, f"{prop.name}#")}, start + rows.nbytes
    # Most files have lists of one length; these are one table.
    counts = _lengths(element, content, start, order)
    table = _table(element, counts, order)
    if table.itemsize * element.count <= left:
        rows = np.frombuffer(content, table, element.count, start)
        if all(
            (rows[f"{place}#"] == rows[f"{place}#"][0]).all()
            for place, prop in enumerate(element.properties)
            if prop.length
        ):
            columns = {prop.name: rows[f"{place}"].reshape(-1) for place, prop in enumerate(element.properties)}
            lengths = {
                f"{prop.name}#": rows[f"{place}#"] for place, prop in enumerate(element.properties) if prop.length
            }
            return columns | lengths, start + rows.nbytes
    return _mixed_columns(element, content, start, order)


def _table(element: PlyElement, counts: list[int], order: str) -> np.dtype:
    fields: list[Any] = []
    remaining = iter(counts)
    for place, prop in enumerate(element.properties):
        if prop.length:
            fields += [(f"{place}#", order + prop.length), (f"{place}", order + prop.kind, (next(remaining),))]
        else:
            fields.append((f"{place}", order + prop.kind))
    return np.dtype(fields)


def _lengths(element: PlyElement, content: bytes, start: int, order: str) -> list[int]:
    """Return the lengths of the first row's lists."""
    columns, _ = _mixed_columns(
        PlyElement(name=element.name, count=1, properties=element.properties), content, start, order
    )
    return [int(columns[f"{prop.name}#"][0]) for prop in element.properties if prop.length]


def _mixed_columns(element: PlyElement, content: bytes, start: int, order: str) -> tuple[Row, int]:
    parts: dict[str, list[bytes]] = {prop.name: [] for prop in element.properties}
    lengths: dict[str, list[int]] = {prop.name: [] for prop in element.properties if prop.length}
    readers = [
        (prop, struct.Struct(order + np.dtype(prop.length).char) if prop.length else None, np.dtype(prop.kind).itemsize)
        for prop in element.properties
    ]
    at = start
    for row in range(element.count):
        for prop, reader, size in readers:
            length = 1
            if reader:
                if at + reader.size > len(content):
                    raise ValueError(f"{element.name} {row} of {element.count}: the file ends before it")
                (length,) = reader.unpack_from(content, at)
                at += reader.size
                lengths[prop.name].append(length)
            if not 0 <= length * size <= len(content) - at:
                raise ValueError(
                    f"{element.name} {row} of {element.count}: announces {length} entries, {length * size} bytes, "
                    f"where {len(content) - at} are left"
                )
            parts[prop.name].append(content[at : at + length * size])
            at += length * size
    columns = {prop.name: np.frombuffer(b"".join(parts[prop.name]), order + prop.kind) for prop in element.properties}
    return columns | {f"{name}#": np.array(counts, dtype=np.int64) for name, counts in lengths.items()}, at


def _positions(columns: Row) -> np.ndarray:
    missing = [axis for axis in "xyz" if axis not in columns or f"{axis}#" in columns]
    if missing:
        raise ValueError(f"has vertices without the coordinate {missing[0]}")
    positions = np.stack([columns[axis].astype(np.float64) for axis in "xyz"], axis=1)
    finite = (np.abs(positions) <= LARGEST).all(axis=1)
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise ValueError(f"vertex {row}: a coordinate must be a finite number, got {positions[row].tolist()}")
    return positions


def _add_rows(polygons: PolygonMesh, element: PlyElement, columns: Row) -> None:
    name = next((name for name in CORNERS if f"{name}#" in columns), None)
    if name is None:
        raise ValueError(f"has an element {element.name!r} without a list of vertex indices")
    sizes, entries = columns[f"{name}#"].tolist(), columns[name]
    if not ((entries == np.floor(entries)) & (np.abs(entries) < 2**31)).all():
        raise ValueError(f"has an element {element.name!r} with an index that is no whole number of 32 bits")
    if element.name == "face":
        polygons.count(sum(max(0, size - 2) for size in sizes))
        polygons.sizes += sizes
        polygons.corners += entries.astype(np.int64).tolist()
        polygons.places += range(len(sizes))
        return
    position = 0
    for row, size in enumerate(sizes):
        strip: list[int] = []
        for entry in [*entries[position : position + size].astype(np.int64).tolist(), -1]:
            if entry >= 0:
                strip.append(entry)
                continue
            for first in range(len(strip) - 2):  # every second triangle of a strip has the opposite winding
                corners = strip[first : first + 3]
                polygons.add(corners if first % 2 == 0 else [corners[1], corners[0], corners[2]], row)
            strip = []
        position += size
