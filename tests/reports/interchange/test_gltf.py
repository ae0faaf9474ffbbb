"""glTF in: placed as trimesh places it, lit by its point lights, and every hostile file refused in one line."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Mesh, SceneError
from rayproof.reports.interchange import import_scene
from rayproof.reports.interchange.framing import is_dark

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")
INDICES = np.array([0, 1, 2, 2, 1, 3], dtype="<u2")


def document(**changes: Any) -> dict[str, Any]:
    """Return a square of two triangles, a camera at z = 4 and a light of 5 cd at z = 3."""
    content = CORNERS.tobytes() + INDICES.tobytes()
    whole = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {
            "KHR_lights_punctual": {
                "lights": [
                    {"type": "point", "intensity": 5.0, "color": [1, 0.5, 0.25]},
                    {"type": "spot", "name": "lamp"},
                ]
            }
        },
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0, "scale": [2, 3, 1]},
            {"camera": 0, "translation": [0, 0, 4]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 3]},
        ],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.5, "zfar": 20, "aspectRatio": 1.5}}
        ],
        "meshes": [{"name": "tile", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1], "metallicFactor": 0}, "doubleSided": True}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "buffers": [
            {"byteLength": 60, "uri": "data:application/octet-stream;base64," + base64.b64encode(content).decode()}
        ],
    }
    return whole | changes


def read(folder: Path, content: Any):
    (folder / "scene.gltf").write_text(json.dumps(content))
    return import_scene(folder / "scene.gltf")


def test_a_scene_is_read_whole(tmp_path: Path) -> None:
    imported = read(tmp_path, document())

    (mesh,), (light,), camera = imported.scene.shapes, imported.scene.lights, imported.scene.camera
    assert isinstance(mesh, Mesh)
    assert imported.dropped == ()
    np.testing.assert_array_equal(mesh.vertices, CORNERS)
    np.testing.assert_array_equal(mesh.faces, INDICES.reshape(-1, 3))
    assert mesh.albedo == (0.1, 0.2, 0.3)
    assert mesh.two_sided
    assert np.diag(mesh.to_world).tolist() == [2, 3, 1, 1]
    assert light.position == (0, 0, 3)
    np.testing.assert_allclose(light.flux, 20 * np.pi * np.array([1, 0.5, 0.25]))
    assert (camera.eye, camera.target, camera.up) == ((0, 0, 4), (0, 0, 3), (0, 1, 0))
    assert camera.fovy == pytest.approx(np.degrees(0.8))
    assert camera.width / camera.height == 1.5
    assert (camera.near, camera.far) == (0.5, 20)


def test_sparse_elements_replace_those_of_the_buffer(tmp_path: Path) -> None:
    whole = document()
    moved = np.array([[7, 8, 9], [-1, -2, -3]], dtype="<f4")
    content = CORNERS.tobytes() + INDICES.tobytes() + bytes([1, 3]) + bytes(2) + moved.tobytes()
    whole["buffers"] = [{"byteLength": len(content), "uri": "data:;base64," + base64.b64encode(content).decode()}]
    whole["bufferViews"] += [
        {"buffer": 0, "byteOffset": 60, "byteLength": 2},
        {"buffer": 0, "byteOffset": 64, "byteLength": 24},
    ]
    sparse = {"count": 2, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3}}
    expected = CORNERS.copy()
    expected[[1, 3]] = moved

    for base, start in (
        (expected, {}),
        (np.where([[False], [True], [False], [True]], expected, 0), {"bufferView": None}),
    ):
        whole["accessors"][0] = {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse}
        for name in start:
            del whole["accessors"][0][name]
        (mesh,) = read(tmp_path, whole).scene.shapes

        assert isinstance(mesh, Mesh)
        np.testing.assert_array_equal(mesh.vertices, base)


def test_without_scenes_all_roots_are_read_and_a_scale_of_0_is_named(tmp_path: Path) -> None:
    whole = document()
    del whole["scenes"]
    whole["nodes"] = [{"children": [1]}, {"mesh": 0}, {"mesh": 0, "name": "hidden", "scale": [0, 1, 1]}]

    imported = read(tmp_path, whole)

    assert len(imported.scene.shapes) == 1
    assert any('the mesh of node "hidden": its matrix is singular' in sentence for sentence in imported.dropped)


def test_without_a_camera_it_is_seen_from_its_front(tmp_path: Path) -> None:
    # Section 3.4: the front of an asset faces +z. From behind, one-sided faces are black.
    whole = document(nodes=[{"mesh": 0}], scenes=[{"nodes": [0]}])
    whole["materials"][0]["doubleSided"] = False

    scene = read(tmp_path, whole).scene

    assert scene.camera.eye[2] > 0
    assert scene.camera.up == (0, 1, 0)
    assert not is_dark(scene)


def test_nodes_are_placed_as_trimesh_places_them(tmp_path: Path) -> None:
    scene, random = trimesh.Scene(), np.random.default_rng(7)
    for number in range(3):
        turn = trimesh.transformations.random_rotation_matrix(random.random(3))
        turn[:3, 3] = random.normal(size=3)
        scene.add_geometry(trimesh.creation.box((1, 2, 3)), node_name=f"box {number}", transform=turn)
    scene.export(str(tmp_path / "boxes.glb"))

    imported = import_scene(tmp_path / "boxes.glb")

    ours = np.concatenate([world_triangles(shape) for shape in imported.scene.shapes])
    theirs = trimesh.load_scene(tmp_path / "boxes.glb").to_mesh().triangles
    # The matrices are float64 in the file, the corners float32: one rounding to float32 lies between them.
    distance = np.abs(ours[:, None] - theirs[None]).max(axis=(2, 3)).min(axis=1)
    assert distance.max() <= 2 * np.finfo(np.float32).eps * np.abs(theirs).max()
    assert len(imported.dropped) >= 2  # it has neither camera nor light


def test_a_node_is_scaled_then_turned_then_moved_within_its_parent(tmp_path: Path) -> None:
    turn, move, scale = [0.1, -0.7, 0.4, 0.9], [1.0, -2.0, 3.0], [2.0, 0.5, -1.5]  # of another length than one
    outer = {"rotation": turn, "translation": move, "scale": scale, "children": [1]}
    inner = {"mesh": 0, "rotation": [0.5, 0.5, -0.5, 0.5], "translation": [4, 5, 6]}

    (mesh,) = read(tmp_path, document(nodes=[outer, inner], scenes=[{"nodes": [0]}])).scene.shapes

    def placed(rotation: list[float], place: list[float]) -> np.ndarray:
        matrix = trimesh.transformations.quaternion_matrix(np.roll(rotation, 1))  # it puts w first
        matrix[:3, 3] = place
        return matrix

    expected = placed(turn, move) @ np.diag([*scale, 1.0]) @ placed([0.5, 0.5, -0.5, 0.5], [4, 5, 6])
    np.testing.assert_allclose(
        mesh.to_world, expected, rtol=0, atol=gamma(12, precision="float64") * np.abs(expected).max()
    )


def changed(path: str, value: Any) -> dict[str, Any]:
    whole = document()
    *way, last = path.split(".")
    place: Any = whole
    for step in way:
        place = place[int(step)] if step.isdigit() else place[step]
    place[int(last) if last.isdigit() else last] = value
    return whole


PRIMITIVE = document()["meshes"][0]["primitives"][0]


@pytest.mark.parametrize(
    ("mode", "faces"),
    [(5, [[0, 1, 2], [1, 2, 2], [2, 2, 1], [2, 3, 1]]), (6, [[1, 2, 0], [2, 2, 0], [2, 1, 0], [1, 3, 0]])],
    ids=["strip", "fan"],
)
def test_strips_and_fans_are_triangles(mode: int, faces: list[list[int]], tmp_path: Path) -> None:
    imported = read(tmp_path, document(meshes=[{"primitives": [{**PRIMITIVE, "mode": mode}]}]))

    (mesh,) = imported.scene.shapes
    assert isinstance(mesh, Mesh)
    # By their corners in order, from whichever they begin (the last of a strip of 0 1 2 2 1 3 is turned).
    turned = [sorted((f[i:] + f[:i]) for i in range(3))[0] for f in mesh.faces.tolist()]
    assert turned == [sorted((f[i:] + f[:i]) for i in range(3))[0] for f in faces]
    assert imported.dropped == ()


HOSTILE = {
    "another version": (changed("asset.version", "1.0"), "version 2"),
    "a list for a document": ([], "version 2"),
    "an accessor beyond its bytes": (changed("accessors.0.count", 400), "reaches to byte"),
    "a count of minus one": (changed("accessors.0.count", -1), "whole number >= 0"),
    "more elements than memory": (changed("accessors.0.count", 10**12), "at most"),
    "a sparse accessor of nothing": (changed("accessors.0.sparse", {}), "count"),
    "too many sparse elements": (
        changed("accessors.0.sparse", {"count": 9, "indices": {}, "values": {}}),
        "sparse.count must be from 1 to 4, got 9",
    ),
    "a node below itself": (changed("nodes.0.children", [0]), "two parents"),
    "a mesh that is not there": (changed("nodes.0.mesh", 7), "none at 7"),
    "a file outside the folder": (changed("buffers.0.uri", "../secret.bin"), "inside the scene's folder"),
    "an address": (changed("buffers.0.uri", "http://localhost/a.bin"), "relative path"),
    "bytes that are not base64": (changed("buffers.0.uri", "data:;base64,@@@"), "not base64"),
    "a singular matrix": (changed("nodes.0.scale", [0, 1, 1]), "singular"),
    "a word for a number": (changed("nodes.0.scale", "wide"), "3 numbers are needed"),
    "an index beyond the vertices": (changed("accessors.0.count", 3), "faces must index"),
    "no angle": (changed("cameras.0.perspective", {"znear": 1}), "yfov"),
    "a light beyond all numbers": (changed("extensions.KHR_lights_punctual.lights.0.intensity", 1e308), "finite"),
    "a camera of no size": (changed("nodes.1.scale", [0, 0, 0]), "finite"),
    "a scale without end": (changed("nodes.0.scale", [float("inf"), 1, 1]), "finite"),
    "a text for a list": (changed("nodes", "all"), "must be a list of objects"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_end_in_one_line(name: str, tmp_path: Path) -> None:
    content, message = HOSTILE[name]

    with pytest.raises(SceneError, match=message) as caught:
        read(tmp_path, content)

    assert "\n" not in str(caught.value)


def packed(text: dict[str, Any], binary: bytes) -> bytes:
    """Return a GLB of two chunks."""
    head, body = json.dumps(text).encode(), binary + bytes(-len(binary) % 4)
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<2I", len(head), 0x4E4F534A) + head + struct.pack("<2I", len(body), 0x004E4942) + body
    return struct.pack("<3I", 0x46546C67, 2, 12 + len(chunks)) + chunks


def test_the_bytes_of_a_glb_are_its_first_buffer_s_alone(tmp_path: Path) -> None:
    content = CORNERS.tobytes() + INDICES.tobytes()
    (tmp_path / "one.glb").write_bytes(packed(document(buffers=[{"byteLength": 60}]), content))
    # A fallback for readers that cannot decompress (EXT_meshopt_compression): a buffer that holds nothing.
    views = [{**view, "buffer": 1} for view in document()["bufferViews"]]
    second = document(buffers=[{"byteLength": 60}, {"byteLength": 60}], bufferViews=views)
    (tmp_path / "two.glb").write_bytes(packed(second, content))

    assert len(import_scene(tmp_path / "one.glb").scene.shapes) == 1
    with pytest.raises(SceneError, match="0 bytes, 60 were announced"):
        import_scene(tmp_path / "two.glb")


@pytest.mark.parametrize(("kind", "code"), [("<i1", 5120), ("<u1", 5121), ("<i2", 5122), ("<u2", 5123)])
def test_normalized_whole_numbers_stand_for_fractions(kind: str, code: int, tmp_path: Path) -> None:
    most = np.iinfo(kind).max
    least = -most - 1 if kind[1] == "i" else 0  # which stands for -1, as -most does
    corners = np.array([[least, 0, 0], [most, 0, 0], [0, most, 0], [most, most, 0]], dtype=kind)
    content = corners.tobytes() + INDICES.tobytes()
    views = [{"buffer": 0, "byteLength": corners.nbytes}, {"buffer": 0, "byteOffset": corners.nbytes}]
    accessors = document()["accessors"]
    accessors[0] |= {"componentType": code, "normalized": True}
    uri = "data:;base64," + base64.b64encode(content).decode()
    whole = document(bufferViews=views, accessors=accessors, buffers=[{"byteLength": len(content), "uri": uri}])

    imported = read(tmp_path, whole | {"extensionsRequired": ["KHR_mesh_quantization"]})

    (mesh,) = imported.scene.shapes
    assert isinstance(mesh, Mesh)
    assert mesh.vertices.tolist() == [[-1.0 if least else 0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    assert not any("KHR_mesh_quantization" in told for told in imported.dropped)
