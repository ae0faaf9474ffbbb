"""Meshes are equal by all that they are, wherever they came from, and by nothing less."""

from dataclasses import replace

import numpy as np
import pytest

from cases.scene import Camera, Mesh, SceneError

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
TENT = Mesh(albedo=(0.5, 0.6, 0.7), vertices=VERTICES, faces=FACES)
MOVED = ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def test_a_mesh_is_equal_to_its_like_from_another_file():
    other = replace(TENT, vertices=VERTICES.copy(), faces=FACES.copy(), file="tent.obj")

    assert other == TENT
    assert hash(TENT) == hash(other)


@pytest.mark.parametrize(
    "change",
    [
        {"vertices": np.nextafter(VERTICES, np.float32(2))},
        {"faces": FACES[::-1]},
        {"albedo": (0.5, 0.6, 0.8)},
        {"to_world": MOVED},
        {"two_sided": True},
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_changes_makes_another_mesh(change):
    assert replace(TENT, **change) != TENT


def test_a_tiny_vertex_is_no_face():
    # To the last bit the bytes of both are the same, taken together.
    first = np.array([[1, 2, 0]], dtype=np.int32)
    with_vertex = replace(TENT, vertices=np.concatenate([VERTICES, first.view(np.float32)]))
    with_face = replace(TENT, faces=np.concatenate([first, FACES]))

    assert with_vertex.vertices.tobytes() + with_vertex.faces.tobytes() == (
        with_face.vertices.tobytes() + with_face.faces.tobytes()
    )
    assert with_vertex != with_face


@pytest.mark.parametrize("far", [1e200, 1.7e308])
@pytest.mark.filterwarnings("error")
def test_up_is_held_against_a_way_whose_square_or_length_overflows(far):
    seen = {"fovy": 40.0, "width": 4, "height": 3, "near": 0.1, "far": 10.0}
    ends = {"eye": (0.0, 0.0, -far), "target": (0.0, 0.0, far)}

    with pytest.raises(SceneError, match="up must not be parallel"):
        Camera(up=(0.0, 0.0, far), **ends, **seen)

    assert Camera(up=(0.0, far, 0.0), **ends, **seen).far == 10.0


@pytest.mark.parametrize("wrong", [2**32, -(2**32), 0.5, float("nan"), 2**70])
def test_a_number_that_is_no_vertex_is_not_rounded_to_one(wrong):
    with pytest.raises(SceneError, match="faces must index the 4 vertices"):
        replace(TENT, faces=np.array([[wrong, 1, 2]]))
