"""A scene file says what it means: round trips are exact, and bad input ends in one line with file, field and value."""

import base64
import json
import os
import zlib
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from rayproof.cases import scene_json
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Mesh, SceneError
from rayproof.cases.scene_json import PACKED, load_scene, save_scene, scene_from_json, scene_to_json
from rayproof.cases.scene_schema import schema

VALIDATOR = Draft202012Validator(schema())
SMALL = [case for case in all_cases() if sum(len(s.faces) for s in case.scene.shapes if isinstance(s, Mesh)) < 1000]
INFINITY = float("inf")


def spoil(document: dict[str, Any], path: str, value: Any) -> None:
    """Put `value` at `path`, such as "shapes/0/radius", in a document."""
    *way, last = (int(step) if step.isdigit() else step for step in path.split("/"))
    place: Any = document
    for step in way:
        place = place[step]
    if value is KeyError:
        del place[last]
    else:
        place[last] = value


@pytest.mark.parametrize("case", all_cases(), ids=[case.name for case in all_cases()])
def test_a_generated_scene_comes_back_from_json_to_the_last_bit(case):
    text = json.dumps(scene_to_json(case.scene))

    assert scene_from_json(json.loads(text), folder=None, where="x.json") == case.scene


@pytest.mark.parametrize("case", SMALL, ids=[case.name for case in SMALL])
def test_the_schema_accepts_a_generated_scene(case):
    assert [error.message for error in VALIDATOR.iter_errors(scene_to_json(case.scene))] == []


def test_save_and_load_are_inverse(document, tmp_path):
    scene = scene_from_json(document, folder=None, where="x.json")

    save_scene(scene, tmp_path / "saved.json")

    assert load_scene(tmp_path / "saved.json") == scene


def test_what_is_left_out_has_the_documented_default(document):
    for key in ("lights", "shading", "clip", "$schema"):
        del document[key]
    document["shapes"] = [{"type": "sphere", "albedo": [1, 1, 1]}]

    scene = scene_from_json(document, folder=None, where="x.json")

    assert (scene.lights, scene.shading, scene.clip) == ((), "inverse_square", "depth")
    assert scene.shapes[0].radius == 1.0  # pyright: ignore[reportAttributeAccessIssue]


# Path, bad value (KeyError: left out), what the message says, whether the schema can tell too.
BAD: list[tuple[str, Any, str, bool]] = [
    ("camera", KeyError, 'scene lacks the key "camera"', True),
    ("shapes", KeyError, 'scene lacks the key "shapes"', True),
    ("shapes", {}, "shapes must be an array, got {}", True),
    ("cammera", {}, 'scene has an unknown key "cammera"; did you mean camera?', True),
    ("$schema", 3, "$schema must be a string, got 3", True),
    ("shading", "phong", 'shading must be one of inverse_square, simplified, got "phong"', True),
    ("clip", None, "clip must be one of depth, shell, none, got null", True),
    ("lights", "sun", 'lights must be an array, got "sun"', True),
    ("lights/0", [], "lights[0] must be an object, got []", True),
    ("lights/0/flux", [1, -2, 3], "lights[0].flux must not be negative, got (1.0, -2.0, 3.0) W", True),
    ("lights/0/flux", [1, 2], "lights[0].flux must be an array of 3, not of 2, got [1, 2]", True),
    ("lights/0/position", [1, 2, True], "lights[0].position[2] must be a number, got true", True),
    ("lights/0/radius", 1, 'lights[0] has an unknown key "radius"; known: position, flux', True),
    ("camera/eye", [0, 0.1, 0], "camera.eye and target must differ, got (0.0, 0.1, 0.0) m twice", False),
    ("camera/eye", [0, float("nan"), 0], "camera.eye[1] must be a finite number, got NaN", False),
    ("camera/eye", "here", 'camera.eye must be an array, got "here"', True),
    ("camera/up", [0, 0, 0], "camera.up must not be zero", False),
    ("camera/up", [4, -3.1, 2.5], "camera.up must not be parallel to the viewing direction", False),
    ("camera/up", [4e200, -3.1e200, 2.5e200], "camera.up must not be parallel to the viewing direction", False),
    ("camera/fovy", 0, "camera.fovy must lie inside (0, 180), got 0.0 degrees", True),
    ("camera/fovy", 180, "camera.fovy must lie inside (0, 180), got 180.0 degrees", True),
    ("camera/fovy", "40", 'camera.fovy must be a number, got "40"', True),
    ("camera/fovy", True, "camera.fovy must be a number, got true", True),
    ("camera/near", 0, "camera.near must be positive, got 0.0 m", True),
    ("camera/near", -1, "camera.near must be positive, got -1.0 m", True),
    ("camera/near", 200, "camera.near must be less than far, got near 200.0 m and far 100.0 m", False),
    ("camera/far", INFINITY, "camera.far must be a finite number, got Infinity", False),
    ("camera/far", 10**400, "camera.far must be a finite number, got 1000000000", False),
    ("camera/far", KeyError, 'camera lacks the key "far"', True),
    ("camera/width", 0, "camera.width must be a positive whole number, got 0 px", True),
    ("camera/width", 96.5, "camera.width must be a whole number, got 96.5", True),
    ("camera/height", -3, "camera.height must be a positive whole number, got -3 px", True),
    ("camera/height", False, "camera.height must be a number, got false", True),
    ("camera/fov", 40, 'camera has an unknown key "fov"; did you mean fovy?', True),
    ("shapes/0", 7, 'shapes[0] must be an object with a "type", got 7', True),
    ("shapes/0/type", KeyError, 'shapes[0] must be an object with a "type", got {"albedo"', True),
    ("shapes/0/type", "torus", "shapes[0].type must be one of sphere, cube, square, plane, triangle, mesh, got", True),
    ("shapes/0/type", ["sphere"], "shapes[0].type must be one of sphere", True),
    ("shapes/0/radius", 0, "shapes[0].radius must be positive, got 0.0 m", True),
    ("shapes/0/radius", -1, "shapes[0].radius must be positive, got -1.0 m", True),
    ("shapes/0/radius", None, "shapes[0].radius must be a number, got null", True),
    ("shapes/0/raduis", 1, 'shapes[0] has an unknown key "raduis"; did you mean radius?', True),
    ("shapes/0/vertices", [], 'shapes[0] has an unknown key "vertices"', True),
    ("shapes/0/albedo", KeyError, 'shapes[0] lacks the key "albedo"', True),
    ("shapes/0/albedo", [0.5, -0.1, 0.5], "shapes[0].albedo must not be negative, got (0.5, -0.1, 0.5)", True),
    ("shapes/0/albedo", 0.5, "shapes[0].albedo must be an array, got 0.5", True),
    ("shapes/1/two_sided", 1, "shapes[1].two_sided must be true or false, got 1", True),
    ("shapes/1/to_world", [1] * 16, "shapes[1].to_world must be an array of 4, not of 16", True),
    ("shapes/1/to_world/2", [0, 0, 0, 0], "shapes[1].to_world is singular", False),
    ("shapes/1/to_world/3", [0, 0, 0, 2], "shapes[1].to_world's last row must be (0, 0, 0, 1)", True),
    ("shapes/1/to_world/0/1", "x", 'shapes[1].to_world[0][1] must be a number, got "x"', True),
    ("shapes/1/to_world/0/1", float("nan"), "shapes[1].to_world[0][1] must be a finite number, got NaN", False),
    ("shapes/4/vertices", [[0, 0, 0], [1, 0, 0]], "shapes[4].vertices must be an array of 3, not of 2", True),
    ("shapes/4/vertices/1", [0, 0], "shapes[4].vertices[1] must be an array of 3, not of 2, got [0, 0]", True),
    ("shapes/4/vertices/1/0", 1e300, "shapes[4].vertices (as float32) must be finite", False),
    ("shapes/5/vertices", [], "shapes[5].vertices must be an array of at least one triple, got []", True),
    ("shapes/5/vertices/2/1", 1e300, "shapes[5].vertices must be finite, got [0.0, inf, 0.0] m at index 2", False),
    ("shapes/5/faces", [], "shapes[5].faces must be an array of at least one triple, got []", True),
    ("shapes/5/faces", KeyError, 'shapes[5] lacks the key "faces"', True),
    ("shapes/5/faces/1/0", 4, "shapes[5].faces must index the 4 vertices, got index 4", False),
    ("shapes/5/faces/1/0", -1, "shapes[5].faces must index the vertices, got [-1, 1, 3] at index 1", True),
    ("shapes/5/faces/1/0", 2**32, "shapes[5].faces must index the vertices, got [4294967296, 1, 3]", False),
    ("shapes/5/faces/1/0", 10**30, "shapes[5].faces holds a whole number beyond 64 bits", False),
    ("shapes/5/faces/1/0", 0.5, "shapes[5].faces[1][0] must be a whole number, got 0.5", True),
    ("shapes/5/file", "a.ply", "shapes[5] has an unknown key", True),
    ("shapes/2/\x1b[31m\n" + "x" * 500, 1, 'shapes[2] has an unknown key "\\u001b[31m\\nxxxx', True),
    ("clip", "\x00" * 10**6, 'clip must be one of depth, shell, none, got "\\u0000', True),
]


@pytest.mark.parametrize(("path", "value", "message"), [(path, value, message) for path, value, message, _ in BAD])
def test_bad_input_is_refused_in_one_line_with_file_field_and_value(document, path, value, message, tmp_path):
    spoil(document, path, value)
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(document))

    with pytest.raises(SceneError) as refusal:
        load_scene(file)

    line = str(refusal.value)
    assert line.startswith(f"{file}: {message}")
    assert line.isprintable()
    assert len(line) < 400


@pytest.mark.parametrize(("path", "value"), [(p, v) for p, v, _, tells in BAD if tells])
def test_the_schema_refuses_what_it_can_tell(document, path, value):
    spoil(document, path, value)

    assert not VALIDATOR.is_valid(document)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        pytest.param(b"", "is not JSON: Expecting value at line 1, column 1", id="empty"),
        pytest.param(b"{", "is not JSON: Expecting property name", id="cut-off"),
        pytest.param(b"\xff\xfe{}", "is not UTF-8: invalid start byte at byte 0", id="not-utf8"),
        pytest.param(b"\xef\xbb\xbf{}", "is not JSON: Unexpected UTF-8 BOM", id="byte-order-mark"),
        pytest.param(b"[1, 2]", "scene must be an object, got [1, 2]", id="an-array"),
        pytest.param(b"null", "scene must be an object, got null", id="null"),
        pytest.param(b"[" * 100_000, "is nested too deeply", id="deep"),
        pytest.param(b"1" * 5000, "is not JSON that can be read: Exceeds the limit", id="5000-digits"),
        pytest.param(b'{"camera": 1, "camera": 2}', 'scene names the key "camera" twice', id="a-key-twice"),
        pytest.param(b'{"camera": {"up": 1, "up": 1}, "shapes": 1}', 'camera names the key "up" twice', id="deeper"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_scene_is_refused(content, message, tmp_path):
    file = tmp_path / "bad.json"
    file.write_bytes(content)

    with pytest.raises(SceneError) as refusal:
        load_scene(file)

    assert str(refusal.value).startswith(f"{file}: {message}")
    assert str(refusal.value).isprintable()


MESH = next(case.scene for case in all_cases() if case.name == "meshes/twenty_thousand_faces")
PACKED_MESH = scene_to_json(MESH, packed=PACKED)


def test_a_packed_mesh_comes_back_to_the_last_bit_and_takes_a_fifth_of_the_room() -> None:
    text = json.dumps(PACKED_MESH)

    assert scene_from_json(json.loads(text), folder=None, where="x.json") == MESH
    assert VALIDATOR.is_valid(PACKED_MESH)
    assert len(text) < len(json.dumps(scene_to_json(MESH))) / 5


def packed(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content)).decode()


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        pytest.param("", "is no deflated base64|must unfold", id="empty"),
        pytest.param("no!", "is no deflated base64", id="no-base64"),
        pytest.param(packed(bytes(10)), "whole ones", id="part-of-a-triple"),
        pytest.param(packed(b""), "at least one triple", id="nothing"),
        pytest.param(packed(bytes(1200))[:20], "is no deflated base64|must unfold", id="truncated"),
        pytest.param(packed(bytes(12 * 1001)), "whole ones", id="more-than-a-scene-may-have"),
        pytest.param(packed(np.full(3, np.nan, "<f4").tobytes()), "vertices must be finite", id="no-number"),
    ],
)
def test_a_packed_mesh_that_is_none_is_refused(vertices: str, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(scene_json.LIMITS, "triangles", 1000)
    mesh = {"type": "mesh", "albedo": [1, 1, 1], "vertices": vertices, "faces": [[0, 0, 0]]}

    with pytest.raises(SceneError, match=message):
        scene_from_json(PACKED_MESH | {"shapes": [mesh]}, folder=None, where="x.json")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        pytest.param("missing.json", "there is no such file", id="missing"),
        pytest.param(".", "is a folder, not a scene file", id="folder"),
        pytest.param("pipe", "is not a regular file", id="pipe"),
        pytest.param("x" * 5000, "cannot be read: File name too long", id="long-name"),
        pytest.param("nul\0", "cannot be read: .*embedded null", id="null-byte"),
    ],
)
def test_a_path_that_is_no_file_is_refused(name, message, tmp_path):
    os.mkfifo(tmp_path / "pipe")

    with pytest.raises(SceneError, match=message) as refusal:
        load_scene(tmp_path / name)

    assert str(refusal.value).isprintable()
