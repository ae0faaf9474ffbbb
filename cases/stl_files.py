"""The reader of STL files, binary and in text: three vertices per triangle, in the file's order.

It counts before it builds: a binary file by its header, a text file line by line. Source: 3D Systems,
StereoLithography Interface Specification (1989).
"""

import io
import struct

import numpy as np

from rayproof.cases.foreign_files import LIMITS
from rayproof.cases.polygon_files import LARGEST, coordinate

HEADER = 84  # bytes: 80 of any content, then the number of triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_mesh(content: bytes) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return vertices (3 m, 3) float64 [m], triangles (m, 3) int64, and sentences about other content of the file.

    Raises:
        ValueError: the file is broken, ends early, or has more triangles than the limit; the message is a sentence.

    """
    vertices, notes = (_text(content), []) if _is_text(content) else _binary(content)
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3), notes


def _is_text(content: bytes) -> bool:
    if len(content) >= HEADER:  # some binary files begin with "solid", too
        (count,) = struct.unpack_from("<I", content, HEADER - 4)
        if len(content) == HEADER + TRIANGLE.itemsize * count:
            return False
    return content[:512].lstrip().lower().startswith(b"solid") and b"facet" in content[:4096].lower()


def _binary(content: bytes) -> tuple[np.ndarray, list[str]]:
    """Return the corners of a binary file's triangles, and sentences about other content of the file."""
    if len(content) < HEADER:
        raise ValueError("is no STL file: it is shorter than the header")
    (count,) = struct.unpack_from("<I", content, HEADER - 4)
    end = HEADER + TRIANGLE.itemsize * count
    if end > len(content):
        raise ValueError(f"has a header that claims {count} triangles, at least {end} bytes, where {len(content)} are")
    _refuse_too_many(count)
    table = np.frombuffer(content, TRIANGLE, count, HEADER)
    with np.errstate(invalid="ignore"):  # of a signalling NaN
        vertices = table["corners"].reshape(-1, 3).astype(np.float64)
    finite = (np.abs(vertices) <= LARGEST).all(axis=1)
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise ValueError(f"triangle {row // 3}: a coordinate must be a finite number, got {vertices[row].tolist()}")
    coloured = int(np.count_nonzero(table["attribute"]))
    notes = [f"{len(content) - end} bytes after its {count} triangles"] if end < len(content) else []
    notes += [f"the colours or attributes of {coloured} triangles"] if coloured else []
    return vertices, notes


def _text(content: bytes) -> np.ndarray:
    """Return the corners of a text file's triangles; its solids are joined."""
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    numbers: list[float] = []
    facets = ends = 0
    for line, text in enumerate(io.BytesIO(content), 1):
        words = text.split()
        statement = words[0].lower() if words else b""
        if statement == b"vertex":
            if len(words) != 4:
                raise ValueError(f"line {line}: a vertex needs three coordinates, got {len(words) - 1}")
            numbers += (coordinate(words[1], line), coordinate(words[2], line), coordinate(words[3], line))
        elif statement == b"facet":
            if len(numbers) != 9 * facets:
                raise ValueError(
                    f"line {line}: the facet before it has {len(numbers) // 3 - 3 * (facets - 1)} vertices, not three"
                )
            facets += 1
            _refuse_too_many(facets)
        elif statement == b"endsolid":
            ends += 1
    if len(numbers) != 9 * facets:
        raise ValueError(
            f"has {len(numbers) // 3} vertices in {facets} facets of three: it ends early, or holds polygons"
        )
    if not ends:
        raise ValueError(f"ends early: no endsolid follows its {facets} facets")
    return np.array(numbers, dtype=np.float64).reshape(-1, 3)


def _refuse_too_many(count: int) -> None:
    if count > LIMITS["triangles"]:
        raise ValueError(f"holds more than {LIMITS['triangles']} triangles")
