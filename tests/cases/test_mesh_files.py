"""Mesh files are read in order and whole; whatever lies outside the folder, claims too much or is broken is refused."""

import json
import os
import struct

import numpy as np
import pytest
import trimesh

from rayproof.cases.foreign_files import Budget
from rayproof.cases.mesh_files import mesh_path, read_mesh
from rayproof.cases.scene import Mesh, SceneError
from rayproof.cases.scene_json import load_scene

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def glb_with(document: dict[str, object], data: bytes = b"") -> bytes:
    """Return a GLB file that holds `document` and `data`."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if data:
        chunks += struct.pack("<II", len(data), 0x004E4942) + data
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def glb_of(
    nodes: list[dict[str, object]],
    *,
    primitives: int = 1,
    count: int = 3,
    indices: bytes = b"",
    without: str = "",
    **members: object,
) -> bytes:
    """Return a GLB file with a mesh of one triangle, whose primitives and accessors may claim more."""
    data = np.eye(3, dtype="<f4").tobytes() + indices
    positions = {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}
    positions.pop(without, None)
    numbers = {"bufferView": 1, "componentType": 5121, "count": len(indices), "type": "SCALAR"}
    primitive = {"attributes": {"POSITION": 0}, **({"indices": 1} if indices else {}), **members}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [primitive] * primitives}],
        "accessors": [positions, numbers],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36}],
        "buffers": [{"byteLength": len(data)}],
    }
    return glb_with(document, data)


@pytest.fixture
def tetrahedron() -> trimesh.Trimesh:
    """Return four faces with known places."""
    return trimesh.Trimesh(vertices=VERTICES, faces=FACES, process=False)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb"])
def test_the_triangles_come_back_in_the_files_order(tetrahedron, suffix, tmp_path):
    tetrahedron.export(tmp_path / f"mesh.{suffix}")

    vertices, faces = read_mesh(f"mesh.{suffix}", tmp_path)

    np.testing.assert_array_equal(vertices[faces], VERTICES[FACES])


def test_faces_of_several_materials_keep_their_order(tmp_path):
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1.5\n"
    faces = "usemtl red\nf 1 3 2\nusemtl blue\r\nf 1 2 4\n  usemtl red\nf 2 3 4\nf 3 1 4\n"
    (tmp_path / "mesh.obj").write_bytes(("mtllib no.mtl\n" + corners + faces).encode())

    vertices, found = read_mesh("mesh.obj", tmp_path)

    assert found.tolist() == FACES.tolist()
    np.testing.assert_array_equal(vertices, VERTICES)


def test_text_files_are_read_too(tetrahedron, tmp_path):
    (tmp_path / "mesh.ply").write_bytes(tetrahedron.export(file_type="ply", encoding="ascii"))
    (tmp_path / "mesh.stl").write_text(tetrahedron.export(file_type="stl_ascii"))

    for name in ("mesh.ply", "mesh.stl"):
        vertices, faces = read_mesh(name, tmp_path)
        np.testing.assert_allclose(vertices[faces], VERTICES[FACES])


def test_bytes_after_an_stl_file_are_left_out_and_reported(tmp_path):
    triangle = bytes(12) + np.array(VERTICES[FACES[0]], np.float32).tobytes() + b"\x01\x80"
    (tmp_path / "mesh.stl").write_bytes(bytes(80) + struct.pack("<I", 1) + triangle + b"after")
    budget = Budget()

    vertices, faces = read_mesh("mesh.stl", tmp_path, budget)

    np.testing.assert_array_equal(vertices[faces], VERTICES[FACES[:1]])
    assert budget.notes[tmp_path / "mesh.stl"] == (
        "5 bytes after its 1 triangles",
        "the colours or attributes of 1 triangles",
    )


def test_a_binary_stl_file_may_begin_as_one_in_text(tmp_path):
    triangle = bytes(12) + np.array(VERTICES[FACES[0]], np.float32).tobytes() + bytes(2)
    (tmp_path / "mesh.stl").write_bytes(b"solid facet maker".ljust(80) + struct.pack("<I", 2) + triangle + triangle)

    assert len(read_mesh("mesh.stl", tmp_path)[1]) == 2


FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"solid a\n{FACET}{FACET}", "ends early: no endsolid follows its 2 facets"),
        (f"solid a\n{FACET}{FACET[:60]}", "has 5 vertices in 2 facets of three"),
        (
            f"solid a\n{FACET}endsolid".replace("endloop", "vertex 1 1 0\nendloop"),
            "has 4 vertices in 1 facets of three",
        ),
    ],
)
def test_text_stl_files_that_end_early_are_refused_with_their_numbers(text, message, tmp_path):
    (tmp_path / "mesh.stl").write_text(text)

    with pytest.raises(SceneError, match=message):
        read_mesh("mesh.stl", tmp_path)


def test_a_glb_scene_is_joined_with_its_nodes_transforms(tetrahedron, tmp_path):
    scene = trimesh.Scene()
    moved = np.eye(4)
    moved[:3, 3] = (10, 20, 30)
    scene.add_geometry(tetrahedron, node_name="here", geom_name="a")
    scene.add_geometry(tetrahedron, node_name="there", geom_name="b", transform=moved)
    scene.export(tmp_path / "two.glb")

    vertices, faces = read_mesh("two.glb", tmp_path)

    corners = np.sort(vertices[faces].reshape(2, -1, 3).mean(axis=1), axis=0)
    np.testing.assert_allclose(corners[1] - corners[0], (10, 20, 30), rtol=1e-6)


def test_a_scene_names_a_mesh_beside_it(document, tetrahedron, tmp_path):
    (tmp_path / "parts").mkdir()
    tetrahedron.export(tmp_path / "parts" / "mesh.ply")
    document["shapes"] = [{"type": "mesh", "albedo": [1, 1, 1], "file": "parts/mesh.ply"}]
    (tmp_path / "scene.json").write_text(json.dumps(document))

    (mesh,) = load_scene(tmp_path / "scene.json").shapes

    assert isinstance(mesh, Mesh)
    assert mesh.file == "parts/mesh.ply"
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], VERTICES[FACES])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "file must be a relative path inside the scene's folder"),
        ("/etc/passwd", "file must be a relative path inside the scene's folder"),
        ("../mesh.ply", "file must be a relative path inside the scene's folder"),
        ("a/../../mesh.ply", "file must be a relative path inside the scene's folder"),
        ("..\\mesh.ply", "file must be a relative path inside the scene's folder"),
        ("C:\\mesh.ply", "file must be a relative path inside the scene's folder"),
        ("mesh\n.ply", "file must be a relative path inside the scene's folder"),
        ("link_out.ply", "file must be a relative path inside the scene's folder, got a link out of it"),
        ("folder_out/mesh.ply", "file must be a relative path inside the scene's folder, got a link out of it"),
        ("loop.ply", "file cannot be opened"),
        ("missing.ply", "file names no file"),
        ("folder.ply", "file must name a regular file"),
        ("pipe.ply", "file must name a regular file"),
        ("mesh.fbx", "file must end in one of .glb, .obj, .ply, .stl"),
        ("scene.ply/mesh.ply", "file "),
        ("x" * 5000 + ".ply", "file cannot be opened"),
    ],
)
def test_a_path_that_leads_elsewhere_is_refused(name, message, tmp_path):
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "mesh.ply").write_text("secret")
    (folder / "scene.ply").write_text("ply")
    (folder / "link_out.ply").symlink_to(tmp_path / "mesh.ply")
    (folder / "folder_out").symlink_to(tmp_path)
    (folder / "loop.ply").symlink_to(folder / "loop.ply")
    (folder / "folder.ply").mkdir()
    os.mkfifo(folder / "pipe.ply")

    with pytest.raises(SceneError) as refusal:
        mesh_path(name, folder)

    assert str(refusal.value).startswith(message)
    assert str(refusal.value).isprintable()


PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n"
PLY += "property list uchar int vertex_indices\nend_header\n"
ACCESSOR = {"count": 10**9, "componentType": 5126, "type": "VEC3"}


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "a.ply",
            PLY.format("binary_little_endian", 900_000_000, 1).encode(),
            "900000000 of its",
        ),
        ("a.ply", PLY.format("ascii", 3, 10**10).encode() + b"0 0 0\n", "announces 3 of its element 'vertex', holds 1"),
        ("a.ply", PLY.format("ascii", -3, 1).encode(), "header with an element that is not counted"),
        ("a.ply", b"ply\nelement vertex 3\nproperty flaot x\nend_header\n", "header with a property of no known type"),
        ("a.ply", b"not a mesh", "is no PLY file"),
        ("a.ply", b"", "is no PLY file"),
        ("a.ply", PLY.format("ascii", 0, 0).encode(), "file "),
        (
            "a.ply",
            PLY.format("ascii", 3, 1).encode() + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 x\n",
            "cannot be understood as PLY",
        ),
        ("a.ply", PLY.format("ascii", 3, 0).encode() + b"0 0 0\n1 0 0\n0 1 0\n", "holds 3 vertices and no polygon"),
        ("a.stl", bytes(80) + struct.pack("<I", 200_000_000) + bytes(50), "header that claims 200000000 triangles"),
        ("a.stl", b"", "is no STL file"),
        ("a.stl", bytes(84), "holds no triangles"),
        ("a.stl", bytes(80) + struct.pack("<I12fH", 1, *[np.nan] * 12, 0), "triangle 0: a coordinate must be a finite"),
        (
            "a.stl",
            f"solid a\n{FACET}{FACET}endsolid".replace("vertex 0 1 0\n", "", 1).replace("endsolid", "vertex 0 1 0\n"),
            "line 8: the facet before it has 2 vertices, not three",
        ),
        (
            "a.stl",
            f"solid a\n{FACET}endsolid".replace("1 0 0", "1 0 x"),
            "line 5: a coordinate must be a finite number",
        ),
        ("a.stl", b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n", "file "),
        ("a.glb", b"glTF" + struct.pack("<4I", 2, 2**32 - 1, 100, 0x4E4F534A), "header that claims its length"),
        ("a.glb", glb_with({"accessors": [ACCESSOR]}), "header that claims its arrays, at least 12000000000 bytes"),
        ("a.glb", glb_with({"accessors": [{"count": "many"}]}), "has a JSON chunk that is not glTF"),
        ("a.glb", glb_with({"accessors": 3}), "has a JSON chunk that is not glTF"),
        ("a.glb", glb_with({"buffers": [{"uri": "../secret.bin"}]}), "keeps data outside itself"),
        ("a.glb", glb_with({"asset": {"version": "2.0"}}), "holds no triangles"),
        ("a.glb", glb_of([{"mesh": 0}] * 200, primitives=200), "takes the scene to 40000 shapes"),
        ("a.glb", glb_of([{"children": [0]}]), "node 0 has two parents"),
        ("a.glb", glb_of([{"mesh": 0}] * 4000, count=400_000), "accessor 0 reaches to byte 4800000 of 36"),
        ("a.glb", glb_of([{"mesh": 0}] * 9000, without="bufferView", count=600_000), "may unfold to at most"),
        ("a.glb", glb_of([{"mesh": 0, "scale": [1e39, 1, 1]}]), "a coordinate must be a finite number"),
        ("a.glb", glb_of([{"mesh": 0}], indices=b"\0\1\3"), "its indices are from 0 to 2, got 3"),
        ("a.glb", glb_of([{"mesh": 7}]), "meshes has 1 entries, none at 7"),
        ("a.glb", glb_of([{"mesh": 0}], extensions={"KHR_draco_mesh_compression": {}}), "it is compressed by Draco"),
        ("a.glb", b"glTF" + struct.pack("<4I", 1, 20, 0, 0), "is glTF of version 1"),
        ("a.obj", b"\x00\x01\x02", "is no OBJ file"),
        ("a.obj", b"", "file "),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "file "),
        ("a.obj", b"v 0 0 0\nf 1 2 9\n", "file "),
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2",
            "line 4: a face names vertices",
        ),
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n f 1/1 2/1 0/1\n",
            "or back from -1, got '0/1'",
        ),
        ("a.obj", b"v a b c\nf 1 1 1\n", "line 1: a coordinate must be a finite number, got 'a'"),
        ("a.obj", b"v 0 0 0\nv 1 1 0\nv 2 0 0\nv 0 1.5 0\nf 1 2 3 4\n", "line 5: the polygon crosses itself"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nl 1 2\n", "holds 2 vertices, 1 lines and no polygon"),
        ("a.ply", PLY.format("ascii", 3, 912).encode() + b"0 0 0\n1 0 0\n0 1 0\n" + 259 * b"3 0 1 2\n", "912 of its"),
        ("a.ply", PLY.format("ascii", 3, 1).encode() + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2 7\n", "1 numbers more than"),
        (
            "a.ply",
            PLY.replace("uchar", "uint").format("binary_little_endian", 3, 2).encode()
            + bytes(36)
            + struct.pack("<4I", 3, 0, 1, 2)
            + struct.pack("<4I", 4_000_000_000, 0, 1, 2),
            "face 1 of 2: announces 4000000000 entries, 16000000000 bytes, where 12 are left",
        ),
    ],
)
def test_a_mesh_file_that_lies_or_is_broken_is_refused_in_one_line(name, content, message, document, tmp_path):
    (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    document["shapes"] = [{"type": "mesh", "albedo": [1, 1, 1], "file": name}]
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(document))

    with pytest.raises(SceneError) as refusal:
        load_scene(scene)

    line = str(refusal.value)
    assert line.startswith(f"{scene}: shapes[0].")
    assert message in line
    assert line.isprintable()
    assert len(line) < 400
