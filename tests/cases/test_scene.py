"""Meshes are equal by all that they are, and similarities are known however their numbers were rounded."""

from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.placement import compose, rotation, scaling, shear, translation
from rayproof.cases.scene import (
    Camera,
    Cube,
    Mesh,
    Plane,
    PointLight,
    Scene,
    SceneError,
    Sphere,
    Square,
    Triangle,
    is_similarity,
)

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


def a_scene(number: Any, whole: Any = int) -> Scene:
    """Return a scene of every class, all of its numbers passed through `number`."""

    def three(x, y, z):
        return (number(x), number(y), number(z))

    pose = tuple(tuple(map(number, row)) for row in MOVED)
    common = {"albedo": three(0.5, 0.6, 0.7), "to_world": pose}
    camera = Camera(
        eye=three(0, 0, 5), target=three(0, 0, 0), up=three(0, 1, 0), fovy=number(40), width=whole(4), height=whole(3),
        near=number(0.5), far=number(64),
    )  # fmt: skip
    shapes = (
        Sphere(**common, center=three(0, 0, 0), radius=number(1)),
        *(kind(**common, two_sided=True) for kind in (Cube, Square, Plane)),
        Triangle(**common, vertices=(three(0, 0, 0), three(1, 0, 0), three(0, 1, 0))),
        Mesh(**common, vertices=VERTICES, faces=FACES),
    )
    return Scene(camera=camera, shapes=shapes, lights=(PointLight(position=three(2, 2, 2), flux=three(100, 90, 80)),))


def numbers_in(value):
    """Yield every number of a scene, at any depth."""
    if isinstance(value, tuple):
        for part in value:
            yield from numbers_in(part)
    elif is_dataclass(value):
        for name in vars(value):
            yield from numbers_in(getattr(value, name))
    elif not isinstance(value, str | np.ndarray) and value is not None:
        yield value


@pytest.mark.parametrize("number", [np.float32, np.float64, np.array], ids=["float32", "float64", "array of nothing"])
def test_numpys_numbers_become_pythons_in_every_field_of_every_class(number):
    scene = a_scene(number, np.int64)

    assert {type(one) for one in numbers_in(scene)} <= {int, float, bool}
    assert scene.camera == a_scene(lambda x: float(np.float32(x)) if number is np.float32 else float(x)).camera


def test_arrays_and_lists_become_tuples_that_can_be_hashed():
    light = PointLight(position=np.array([1.0, 2.0, 3.0]), flux=[1, 2, 3])  # pyright: ignore[reportArgumentType]

    assert light == PointLight(position=(1.0, 2.0, 3.0), flux=(1.0, 2.0, 3.0))
    assert hash(light)


@pytest.mark.parametrize("wrong", ["1", None, 1j, True, (1.0, 2.0)], ids=repr)
def test_what_is_no_number_is_refused_where_it_is_made(wrong):
    light = {"position": (0.0, 0.0, 0.0), "flux": (1.0, 1.0, 1.0)}

    with pytest.raises(SceneError, match="position must be"):
        PointLight(**light | {"position": (wrong, 0.0, 0.0)})
    with pytest.raises(SceneError, match="radius must be"):
        Sphere(albedo=(0.5, 0.5, 0.5), radius=wrong)
    with pytest.raises(SceneError, match="lights must be made of PointLight"):
        replace(a_scene(float), lights=(wrong,))


@pytest.mark.parametrize("wrong", [2**32, -(2**32), 0.5, float("nan"), 2**70])
def test_a_number_that_is_no_vertex_is_not_rounded_to_one(wrong):
    with pytest.raises(SceneError, match="faces must index the 4 vertices"):
        replace(TENT, faces=np.array([[wrong, 1, 2]]))


TURNED = compose(translation(1e3, -2, 5), rotation((0.3, -0.5, 0.8), 71))


@pytest.mark.parametrize("factor", [1e-6, 1.0, 3e7])
def test_turning_moving_mirroring_and_scaling_evenly_keep_spheres(factor: float) -> None:
    assert is_similarity(compose(TURNED, scaling(factor, factor, factor)))
    assert is_similarity(compose(TURNED, scaling(factor, -factor, factor)))


@pytest.mark.parametrize(
    "matrix",
    [scaling(1, 1, 1 + 1e-12), scaling(1e-7, 1e-7, 2e-7), shear(xy=1e-12, xz=0, yz=0), shear(xy=0, xz=0, yz=2)],
)
def test_stretching_and_shearing_do_not(matrix) -> None:
    assert not is_similarity(compose(TURNED, matrix))
