"""The importers' guard: a mesh of so many vertices that 15 bits do not number them, and each way to tell an angle.

Every renderer is given what an importer made of a file: no comparison can see what it lost or mixed up.
"""

import json
import math
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Mesh
from rayproof.reports.interchange import import_scene
from tests.harness.guards import BrokenHarnessError

# A fan of thin triangles, an even number of them, that use vertices on either side of 2^15 and near the last one.
COUNT = 33_000
VERTICES = np.stack(
    [np.arange(COUNT) / 1024, np.arange(COUNT) % 7, np.arange(COUNT) % 11 + np.arange(COUNT) % 2], axis=-1
).astype(np.float32)
FIRST = np.array((0, 5, 16_000, 32_764, 32_765, 32_766, 32_767, 32_768, COUNT - 4, COUNT - 3))
FACES = np.stack([FIRST, FIRST + 1, FIRST + 2], axis=-1).astype(np.int32)
# An image of 4 x 3 pixels has a diagonal of 5: with 90 degrees along it, tan of half the vertical angle is 3/5.
SIZES = {(4, 3): {"x": 3 / 4, "y": 1.0, "diagonal": 3 / 5, "smaller": 1.0, "larger": 3 / 4}} | {
    (3, 4): {"x": 4 / 3, "y": 1.0, "diagonal": 4 / 5, "smaller": 4 / 3, "larger": 1.0}
}
CLOSE = 1e-12  # relative
XML = """<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="90"/>
<string name="fov_axis" value="{axis}"/><film type="hdrfilm"><integer name="width" value="{width}"/>
<integer name="height" value="{height}"/></film></sensor>
<shape type="ply"><string name="filename" value="fan.ply"/></shape>
<emitter type="point"><point name="position" x="1" y="2" z="3"/></emitter></scene>"""


def guard_importers() -> None:
    """Import the mesh from every kind of file, and every angle; raise BrokenHarnessError where anything differs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, write in WRITERS.items():
            (folder / file).write_bytes(write())
        for file in WRITERS:
            _expect_fan(folder / file, file)
        for (width, height), tangents in SIZES.items():
            for axis, tangent in tangents.items():
                file = folder / "scene.xml"
                file.write_text(XML.format(axis=axis, width=width, height=height), encoding="utf-8")
                _expect_angle(file, f"{axis} of {width} x {height} pixels", math.degrees(2 * math.atan(tangent)))
        _expect_fan(folder / "scene.xml", "a PLY file in a Mitsuba scene")


def _expect_fan(file: Path, what: str) -> None:
    meshes = [shape for shape in import_scene(file).scene.shapes if isinstance(shape, Mesh)]
    corners = [mesh.vertices[mesh.faces] for mesh in meshes]
    if len(corners) != 1 or not np.array_equal(corners[0], VERTICES[FACES]):
        raise BrokenHarnessError(f"the importers are broken: the faces of {what} are other ones")


def _expect_angle(file: Path, what: str, fovy: float) -> None:
    found = import_scene(file).scene.camera.fovy
    if not abs(found - fovy) <= CLOSE * fovy:
        raise BrokenHarnessError(f"the importers are broken: 90 degrees along {what} are fovy {fovy:g}, got {found:g}")


def _obj() -> bytes:
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in VERTICES.tolist()]
    return "\n".join([*lines, *("f {} {} {}".format(*face) for face in (FACES + 1).tolist()), ""]).encode()


def _ply() -> bytes:
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {COUNT}"]
    header += [*(f"property float {axis}" for axis in "xyz"), f"element face {len(FACES)}"]
    header += ["property list uchar ushort vertex_indices", "end_header", ""]
    faces = b"".join(struct.pack("<B3H", 3, *face) for face in FACES.tolist())
    return "\n".join(header).encode() + VERTICES.astype("<f4").tobytes() + faces


def _glb(component: int, kind: str) -> bytes:
    points, indices = VERTICES.astype("<f4").tobytes(), FACES.astype(kind).tobytes()
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
            {"bufferView": 0, "componentType": 5126, "count": COUNT, "type": "VEC3"},
            {"bufferView": 1, "componentType": component, "count": FACES.size, "type": "SCALAR"},
        ],
    }
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    binary = points + indices + bytes(-len(points + indices) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


WRITERS: dict[str, Callable[[], bytes]] = {
    "fan.obj": _obj,
    "fan.ply": _ply,
    "short.glb": lambda: _glb(5123, "<u2"),
    "long.glb": lambda: _glb(5125, "<u4"),
}
