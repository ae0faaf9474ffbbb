"""The loader's guard: one small mesh in every file format, read back to the last bit, and placed by exact arithmetic.

The mesh is a skew pyramid without any symmetry, and its coordinates fill 24 bits: a swapped axis, a turned face, a
lost face, a shifted index or a rounding too many changes some number.
"""

import json
import struct
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np

from rayproof.cases import placement, scene_json
from rayproof.cases.scene import Matrix, Mesh
from tests.harness.guards import BrokenHarnessError

VERTICES = np.array(
    (
        (-0.81234567, -0.70123454, -0.31234568),
        (0.92345679, -0.61234570, -0.20123457),
        (0.73456788, 0.84567893, -0.41234568),
        (-0.65432101, 0.57654321, -0.27654323),
        (0.12345679, -0.05432104, 1.13456786),
    ),
    dtype=np.float32,
)
FACES = np.array(((0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)), dtype=np.int32)
# Numbers of few bits, so that float64 places the corners exactly; sheared, stretched, moved and mirrored.
PLACES: dict[str, Matrix] = {
    "moved": ((1.25, 0.5, 0.0, 3.0), (-0.25, 0.75, 0.5, -2.0), (0.0, -0.5, 1.5, 0.625), (0.0, 0.0, 0.0, 1.0)),
    "mirrored": ((-1.25, 0.5, 0.0, 3.0), (0.25, 0.75, 0.5, -2.0), (0.0, -0.5, 1.5, 0.625), (0.0, 0.0, 0.0, 1.0)),
}


def guard_loader() -> None:
    """Read the mesh in every format and bake it in every place; raise BrokenHarnessError where anything differs."""
    corners = VERTICES[FACES]
    with tempfile.TemporaryDirectory() as folder:
        for suffix, write in WRITERS.items():
            (Path(folder) / f"pyramid.{suffix}").write_bytes(write())
            for place, to_world in PLACES.items():
                mesh = _loaded(Path(folder), f"pyramid.{suffix}", to_world)
                if not np.array_equal(mesh.vertices[mesh.faces], corners):
                    raise BrokenHarnessError(f"the mesh loader is broken: {suffix.upper()} is read with other corners")
                if not np.array_equal(placement.world_triangles(mesh), _placed(to_world)):
                    raise BrokenHarnessError(f"the mesh loader is broken: a mesh {place} is baked with other corners")


def _loaded(folder: Path, name: str, to_world: Matrix) -> Mesh:
    """Return the mesh of a scene file that names `name`, as any user's scene would be loaded."""
    scene = {
        "camera": {
            "eye": [0, -9, 0],
            "target": [0, 0, 0],
            "up": [0, 0, 1],
            "fovy": 40,
            "width": 2,
            "height": 2,
            "near": 0.1,
            "far": 99,
        },
        "shapes": [
            {"type": "mesh", "albedo": [0.5, 0.5, 0.5], "file": name, "to_world": [list(row) for row in to_world]}
        ],
        "lights": [],
    }
    path = folder / "scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    (mesh,) = scene_json.load_scene(path).shapes
    assert isinstance(mesh, Mesh)
    return mesh


def _placed(to_world: Matrix) -> np.ndarray:
    """Return the corners in world space by rational arithmetic, rounded once; a mirror swaps the last two of a face."""
    mirrored = np.linalg.det(np.asarray(to_world)[:3, :3]) < 0
    corners = VERTICES[FACES[:, [0, 2, 1]] if mirrored else FACES]
    placed = [
        sum((Fraction(c) * Fraction(float(x)) for c, x in zip(row, (*corner, 1.0), strict=True)), start=Fraction(0))
        for corner in corners.reshape(-1, 3)
        for row in to_world[:3]
    ]
    return np.array([float(number) for number in placed]).astype(np.float32).reshape(corners.shape)


def _obj() -> bytes:
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in VERTICES]
    return "\n".join([*lines, *("f {} {} {}".format(*(face + 1)) for face in FACES), ""]).encode()


def _ply() -> bytes:
    kinds = [f"property float {axis}" for axis in "xyz"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(VERTICES)}", *kinds]
    header += [f"element face {len(FACES)}", "property list uchar int vertex_indices", "end_header", ""]
    faces = b"".join(struct.pack("<B3i", 3, *map(int, face)) for face in FACES)
    return "\n".join(header).encode() + VERTICES.astype("<f4").tobytes() + faces


def _stl() -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 0, *map(float, corners.ravel()), 0) for corners in VERTICES[FACES]]
    return bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def _glb() -> bytes:
    points, indices = VERTICES.astype("<f4").tobytes(), FACES.astype("<u4").tobytes()
    low, high = VERTICES.min(axis=0).tolist(), VERTICES.max(axis=0).tolist()
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(points) + len(indices)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(VERTICES), "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5125, "count": FACES.size, "type": "SCALAR"},
        ],
    }
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(points) + len(indices), 0x004E4942) + points + indices
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


WRITERS: dict[str, Callable[[], bytes]] = {"obj": _obj, "ply": _ply, "stl": _stl, "glb": _glb}
