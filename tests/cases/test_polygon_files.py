"""OBJ and PLY in every dialect: vertices as written, and polygons with the area vector that their corners have."""

import struct
from collections.abc import Callable
from time import process_time

import numpy as np
import pytest

from rayproof.cases.foreign_files import LIMITS
from rayproof.cases.mesh_files import READERS
from rayproof.cases.stl_files import stl_mesh

CORNER_L = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
HEADER = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACES_OF = "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def faces(kind: str, content: str | bytes) -> list[list[int]]:
    """Return the triangles of a file."""
    return READERS[kind](content.encode() if isinstance(content, str) else content)[1].tolist()


def area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the vector area of triangles."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a).sum(axis=0) / 2


def test_negative_indices_count_back_from_the_vertices_so_far() -> None:
    block = "v 0 0 {0}\nv 1 0 {0}\nv 0 1 {0}\nf -3{1} -2{1} -1{1}\n"

    for slots in ("", "/-1/-1", "//-1"):
        assert faces("obj", block.format(0, slots) + block.format(1, slots)) == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize("order", ["1 2 3 4 5 6", "4 5 6 1 2 3", "6 5 4 3 2 1"])
def test_a_concave_polygon_keeps_its_notch(order: str) -> None:
    vertices, triangles, notes = READERS["obj"](f"{CORNER_L}f {order}\n".encode())
    centres = vertices[triangles].mean(axis=1)

    assert abs(area(vertices, triangles)[2]) == 3
    assert not ((centres[:, 0] > 1) & (centres[:, 1] > 1)).any()
    assert notes == []


def test_a_window_stays_open() -> None:
    corners = ["0", "0", "3", "0", "3", "3", "0", "3", "1", "1", "1", "2", "2", "2", "2", "1"]
    text = "".join(f"v {x} {y} 5\n" for x, y in zip(corners[::2], corners[1::2], strict=True))
    vertices, triangles, _ = READERS["obj"]((text + "f 1 2 3 4 1 5 6 7 8 5\n").encode())
    inside = np.array([1.5, 1.5])
    a, b, c = (vertices[triangles[:, k], :2] for k in range(3))
    sides = [np.linalg.det(np.stack([q - p, inside - p], axis=1)) for p, q in ((a, b), (b, c), (c, a))]

    np.testing.assert_allclose(area(vertices, triangles), [0, 0, 8])
    assert not np.all(np.array(sides) > 0, axis=0).any()


def comb(teeth: int) -> tuple[np.ndarray, bytes]:
    """Return the corners of a polygon with as many teeth on two sides, and its OBJ file."""
    k = np.arange(teeth)
    low, high = np.where(k % 2, 9.5, -0.5), np.where(k % 2, 10.0, 0.5)
    corners = np.concatenate([np.stack([k, high, 0 * k], axis=1), np.stack([k, low, 0 * k], axis=1)[::-1]])
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
    return corners, "\n".join([*lines, f"f {' '.join(map(str, range(1, 2 * teeth + 1)))}\n"]).encode()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        pytest.param(
            comb(20_000)[1], "line 40001: the polygons up to it take more than 512000000 steps to cut", id="corners"
        ),
        pytest.param(
            CORNER_L.encode() + b"f" + b" 1 2 3" * 40_000, "line 7: a polygon has 120000 corners", id="more-corners"
        ),
        pytest.param(CORNER_L.encode() + b"f 1 2 3\n" * 1001, "holds more than 1000 triangles", id="triangles"),
        pytest.param(CORNER_L.encode() + b"f" + b" 1 2 3" * 400, "holds more than 1000 triangles", id="one-polygon"),
    ],
)
def test_a_polygon_bomb_is_refused_in_little_time(
    content: bytes, message: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    if "1000 triangles" in message:
        monkeypatch.setitem(LIMITS, "triangles", 1000)
    begun = process_time()

    with pytest.raises(ValueError, match=message):
        READERS["obj"](content)

    assert process_time() - begun < 10


def test_line_ends_comments_tabs_and_continued_lines() -> None:
    text = "# a\n\tv 0 0 0 # first\nv\t1 0 0\nv 0 1 \\\n 0\n  f 1 2 \\\n3 # last\n"

    for end in ("\n", "\r\n", "\r"):
        assert faces("obj", text.replace("\n", end)) == [[0, 1, 2]]


def test_what_is_not_flat_or_has_two_corners_is_reported_with_its_line() -> None:
    _, _, notes = READERS["obj"](b"v 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\nf 1 2 3 4\nf 1 2\n")

    assert notes == [
        "1 faces of fewer than three corners, the first in line 6",
        "that 1 polygons are not flat, the first in line 5: triangles stand in their place",
    ]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_ply_file_in_text_has_comments_anywhere_and_strips(end: str) -> None:
    text = HEADER.replace("format", "comment x\nobj_info y\nformat")
    text += "comment z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n" + SQUARE
    text += "comment in the body\n7 0 1 3 2 -1 0 1\n"

    assert faces("ply", text.replace("\n", end)) == [[0, 1, 3], [3, 1, 2]]


def test_a_binary_ply_file_mixes_triangles_and_quads() -> None:
    for layout, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        head = HEADER.replace("ascii", layout) + "element face 3\nproperty list uchar int vertex_index\n"
        head += "property uchar red\nend_header\n"
        body = struct.pack(f"{order}12f", *map(float, SQUARE.split()))
        for corners in ([0, 1, 2], [0, 1, 2, 3], [2, 3, 0]):
            body += struct.pack(f"{order}B{len(corners)}iB", len(corners), *corners, 200)

        assert faces("ply", head.encode() + body) == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [2, 3, 0]]


@pytest.mark.parametrize(
    ("kind", "content", "message"),
    [
        ("ply", HEADER.replace("4", "912") + "end_header\n" + SQUARE, r"announces 912 .*'vertex', holds 4"),
        ("ply", HEADER + FACES_OF.format(912) + SQUARE + "3 0 1 2\n" * 259, r"announces 912 .*'face', holds 259"),
        ("ply", HEADER + FACES_OF.format(1) + SQUARE + "4000000000 0 1 2\n", "face 0: announces more entries"),
        (
            "ply",
            (HEADER.replace("ascii", "binary_little_endian") + FACES_OF.format(1).replace("uchar", "uint")).encode()
            + struct.pack("<12f", *map(float, SQUARE.split()))
            + struct.pack("<I3i", 4_000_000_000, 0, 1, 2),
            "face 0 of 1: announces 4000000000 entries, 16000000000 bytes, where 12 are left",
        ),
        (
            "ply",
            (HEADER.replace("ascii", "binary_little_endian") + FACES_OF.format(4 * 10**9)).encode() + bytes(48),
            "announces 4000000000 of its element 'face', at least 4000000000 bytes, where 0 are left",
        ),
        (
            "ply",
            (HEADER.replace("ascii", "binary_little_endian") + FACES_OF.format(0)).encode() + bytes(48),
            "holds 4 vertices and no polygon",
        ),
        ("obj", CORNER_L + f"f 1 2 {10**30}\n", "line 7: a face names vertices by numbers"),
        ("obj", CORNER_L + "f 1 2 7\n", "line 7: names vertex 7, where 6 are"),
        ("obj", CORNER_L + "l 1 2\nl 2 3\np 1\n", "holds 6 vertices, 2 lines, 1 points and no polygon"),
        ("obj", "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 3 4\n", "line 6: the polygon crosses itself"),
    ],
)
def test_what_is_broken_is_refused_with_its_numbers(kind: str, content: str | bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        faces(kind, content)


# Random meshes of random polygons, written in a random dialect of each format


def polygon(draw: np.random.Generator) -> np.ndarray:
    """Return a flat polygon without crossings (n, 3), as floats of 32 bits: star-shaped, often concave."""
    n = int(draw.integers(3, 9))
    angles = np.sort(draw.uniform(0, 2 * np.pi, n))
    while np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3:  # the centre lies inside
        angles = np.sort(draw.uniform(0, 2 * np.pi, n))
    reach = draw.uniform(0.3, 1, n)
    axes = np.linalg.qr(draw.normal(size=(3, 3)))[0][:2]
    return (reach * np.array([np.cos(angles), np.sin(angles)])).T @ axes + draw.normal(size=3)


def obj_text(draw: np.random.Generator, polygons: list[np.ndarray]) -> bytes:
    """Return an OBJ file of some dialect."""
    lines, count = ["o thing"], 0
    for corners in polygons:
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
        names = [k - len(corners) if draw.integers(2) else count + k + 1 for k in range(len(corners))]
        slot = str(draw.choice(["", "/1", "//1", "/1/1"]))
        lines.append("f " + " ".join(f"{name}{slot}" for name in names) + str(draw.choice(["", " # face", "\t"])))
        count += len(corners)
    return str(draw.choice(["\n", "\r\n", "\r"])).join([*lines, ""]).encode()


def ply_text(draw: np.random.Generator, polygons: list[np.ndarray]) -> bytes:
    """Return a PLY file of some dialect."""
    layout, order = [("ascii", ""), ("binary_little_endian", "<"), ("binary_big_endian", ">")][draw.integers(3)]
    length, code = [("uchar", "B"), ("int", "i"), ("ushort", "H")][draw.integers(3)]
    vertices = [point for corners in polygons for point in corners.tolist()]
    end = str(draw.choice(["\n", "\r\n", "\r"]))
    lines = ["ply", f"format {layout} 1.0", "comment made", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"] + [f"element face {len(polygons)}"]
    lines += [f"property list {length} int vertex_indices", "property float quality", "end_header", ""]
    rows, count = [], 0
    for corners in polygons:
        rows.append([len(corners), *range(count, count + len(corners))])
        count += len(corners)
    head = end.join(lines).encode()
    if not order:
        body = [" ".join(map(repr, point)) for point in vertices] + [" ".join(map(str, [*row, 0.5])) for row in rows]
        return head + end.join([*body, ""]).encode()
    body = b"".join(struct.pack(f"{order}3d", *point) for point in vertices)
    return head + body + b"".join(struct.pack(f"{order}{code}{row[0]}if", *row, 0.5) for row in rows)


@pytest.mark.parametrize(("kind", "written"), [("obj", obj_text), ("ply", ply_text)])
def test_random_polygons_of_every_dialect_keep_positions_and_areas(
    kind: str, written: Callable[[np.random.Generator, list[np.ndarray]], bytes]
) -> None:
    draw = np.random.default_rng(35_001)
    for _ in range(700):
        polygons = [polygon(draw) for _ in range(int(draw.integers(1, 5)))]
        vertices, triangles, _ = READERS[kind](written(draw, polygons))
        starts = np.cumsum([0, *(len(corners) for corners in polygons)])

        np.testing.assert_array_equal(vertices, np.concatenate(polygons))
        for corners, first, last in zip(polygons, starts[:-1], starts[1:], strict=True):
            own = triangles[(triangles[:, 0] >= first) & (triangles[:, 0] < last)]
            fan = np.array([[0, k, k + 1] for k in range(1, len(corners) - 1)])
            np.testing.assert_allclose(area(vertices, own), area(corners, fan), atol=1e-13)
            normal = area(corners, fan)
            turns = np.cross(vertices[own[:, 1]] - vertices[own[:, 0]], vertices[own[:, 2]] - vertices[own[:, 0]])
            assert (turns @ normal >= -1e-13).all()  # none turned over: together they cover the polygon once


def test_random_stl_files_keep_the_area_of_each_triangle() -> None:
    draw = np.random.default_rng(35_002)
    for _ in range(700):
        corners = draw.normal(size=(int(draw.integers(1, 6)), 3, 3)).astype(np.float32)
        if draw.integers(2):
            content = bytes(80) + struct.pack("<I", len(corners))
            content += b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in corners)
        else:
            facets = (
                "facet normal 0 0 0\nouter loop\n"
                + "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle.tolist())
                + "endloop\nendfacet\n"
                for triangle in corners
            )
            content = ("solid a\n" + "".join(facets) + "endsolid a\n").encode()

        vertices, triangles, notes = stl_mesh(content)

        assert notes == []
        np.testing.assert_array_equal(vertices[triangles].astype(np.float32), corners)
