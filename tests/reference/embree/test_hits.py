"""Which triangle Embree names, and where float64 meets its plane, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.placement import compose, translation
from rayproof.cases.scene import IDENTITY, Cube, Mesh, Scene, Square, Triangle
from rayproof.cases.stages import Stage
from tests.reference.mitsuba3.geometry import (
    GENERIC,
    HIT,
    MIRRORED,
    SHEARED,
    WHITE,
    answer,
    directions,
    gradient_normals,
    looking_down,
)

# What float32 decided is met again in float64, in coordinates of some metres: a hundred roundings of ten.
CLOSE = 1000 * 2.0**-53


def largest_coordinate(points):
    axis = np.abs(points).argmax(-1)
    return np.eye(3)[axis] * np.sign(np.take_along_axis(points, axis[..., None], -1))


def level(size, height):
    return ((size, 0, 0, 0), (0, size, 0, 0), (0, 0, 1, height), (0, 0, 0, 1.0))


def test_rays_pass_through_pixel_centers(embree):
    ray, shape = answer(embree, Scene(camera=GENERIC, shapes=()), Stage.RAY, Stage.OBJECT)

    assert np.abs(ray - directions(GENERIC)[:, :, 0]).max() <= 8 * 2.0**-53
    assert np.all(shape == -1)


def test_a_miss_has_the_values_that_the_specification_gives_it(embree):
    behind = Square(albedo=WHITE, to_world=level(2.0, 9.0))
    scene = Scene(camera=looking_down(height=5), shapes=(behind,))

    shape, distance, position, normal = answer(embree, scene, *HIT)

    assert np.all(shape == -1)
    assert np.all(distance == np.inf)
    assert not position.any()
    assert not normal.any()


@pytest.mark.parametrize("to_world", [IDENTITY, SHEARED, MIRRORED], ids=["unit", "sheared", "mirrored"])
def test_a_cube_has_one_face_index_and_outward_normals(embree, to_world):
    scene = Scene(camera=GENERIC, shapes=(Cube(albedo=WHITE, to_world=to_world),))

    shape, distance, position, normal = answer(embree, scene, *HIT)

    hit = shape[..., 0] == 0
    inverse = np.linalg.inv(to_world)
    ordered = np.sort(np.abs(position @ inverse[:3, :3].T + inverse[:3, 3]), axis=-1)
    clear = hit & (ordered[..., 1] < 0.49)
    assert clear.sum() > 40
    assert np.all(shape[hit, 1] == 0)
    assert np.abs(ordered[hit, 2] - 0.5).max() <= CLOSE
    along = GENERIC.eye + distance * directions(GENERIC)[:, :, 0]
    assert np.abs(along[hit] - position[hit]).max() <= CLOSE
    outward = gradient_normals(to_world, position[clear], largest_coordinate)
    assert np.abs(normal[clear] - outward).max() <= CLOSE


def test_every_side_of_a_cube_is_there(embree):
    for axis, sign in [(axis, sign) for axis in range(3) for sign in (-1, 1)]:
        outward = np.eye(3)[axis] * sign
        camera = replace(looking_down(height=5), eye=tuple(4 * outward), up=tuple(np.eye(3)[axis - 1]))

        position, normal = answer(embree, Scene(camera=camera, shapes=(Cube(albedo=WHITE),)), *HIT[2:])

        middle = (camera.height // 2, camera.width // 2)
        assert normal[middle] == pytest.approx(outward)
        assert position[middle] == pytest.approx(outward / 2, abs=CLOSE)


@pytest.mark.parametrize("two_sided", [False, True])
def test_a_square_seen_from_behind_turns_its_normal_only_if_two_sided(embree, two_sided):
    camera = replace(looking_down(height=5), eye=(0.2, -0.1, -5))
    scene = Scene(camera=camera, shapes=(Square(albedo=WHITE, two_sided=two_sided, to_world=MIRRORED),))

    shape, normal = answer(embree, scene, Stage.OBJECT, Stage.NORMAL)

    hit = shape[..., 0] == 0
    outward = np.linalg.inv(MIRRORED)[2, :3]
    outward /= np.linalg.norm(outward)
    assert hit.any()
    assert np.abs(normal[hit] - (-outward if two_sided else outward)).max() <= CLOSE


@pytest.mark.parametrize("to_world", [IDENTITY, MIRRORED], ids=["unit", "mirrored"])
def test_a_triangle_has_the_normal_of_its_winding_in_object_space(embree, to_world):
    vertices = ((-1.0, -1.0, 0.25), (1.5, -1.0, 0.5), (0.0, 1.25, -0.25))
    scene = Scene(camera=GENERIC, shapes=(Triangle(albedo=WHITE, vertices=vertices, to_world=to_world),))

    shape, normal = answer(embree, scene, Stage.OBJECT, Stage.NORMAL)

    hit = shape[..., 0] == 0
    a, b, c = np.asarray(vertices)
    outward = gradient_normals(to_world, np.zeros(3), lambda local: np.cross(b - a, c - a))
    assert hit.sum() > 40
    assert np.abs(normal[hit] - outward).max() <= CLOSE


def test_a_mesh_tells_its_faces_apart_and_skips_those_without_area(embree):
    vertices = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float32)
    faces = np.array([(0, 0, 1), (0, 1, 2), (1, 1, 1), (0, 2, 3)])
    mesh = Mesh(albedo=WHITE, vertices=vertices, faces=faces)
    scene = Scene(camera=looking_down(height=5, fovy=35), shapes=(mesh,))

    shape, position = answer(embree, scene, Stage.OBJECT, Stage.POSITION)

    apart = position[..., 0] - position[..., 1]
    clear = (shape[..., 0] == 0) & (np.abs(apart) > 1e-3)
    assert clear.sum() > 100
    assert np.array_equal(shape[clear, 1], np.where(apart[clear] > 0, 1, 3))


def test_rays_do_not_pass_between_triangles_that_share_an_edge(embree):
    # The diagonal of the square runs through pixel centres.
    camera = replace(looking_down(height=5, width=33, rows=33), up=(0.0, 1.0, 0.0))
    scene = Scene(camera=camera, shapes=(Square(albedo=WHITE, to_world=level(9.0, 0.0)),))

    (shape,) = answer(embree, scene, Stage.OBJECT)

    assert not shape.any()


@pytest.mark.parametrize(("clip", "seen"), [("depth", 1.0), ("shell", None), ("none", 0.0)])
def test_what_is_clipped_lets_see_what_is_behind(embree, clip, seen):
    camera = looking_down(height=5, near=1.01, far=5.2, fovy=30)
    shapes = tuple(Square(albedo=WHITE, to_world=level(size, height)) for size, height in ((3.0, 4.0), (9.0, 0.0)))

    shape, distance = answer(embree, Scene(camera=camera, shapes=shapes, clip=clip), Stage.OBJECT, Stage.DISTANCE)

    cosine = -directions(camera)[:, :, 0, 2]
    expected = np.full(cosine.shape, seen) if seen is not None else np.where(1 / cosine > 1.01, 0.0, 1.0)
    assert np.array_equal(shape[..., 0], expected)
    assert np.abs(distance[..., 0] - np.where(expected == 0, 1, 5) / cosine).max() <= CLOSE


@pytest.mark.parametrize("size", [1e-30, 1e-6, 1e6, 1e30])
def test_the_size_of_a_scene_costs_no_digits(embree, size):
    camera = looking_down(height=5 * size, near=0.1 * size, far=10 * size)
    matrix = ((2 * size, 0, 0, 0), (0, 2 * size, 0, 0), (0, 0, size, size), (0, 0, 0, 1.0))

    shape, distance = answer(
        embree, Scene(camera=camera, shapes=(Square(albedo=WHITE, to_world=matrix),)), Stage.OBJECT, Stage.DISTANCE
    )

    cosine = -directions(camera)[:, :, 0, 2]
    hit = shape[..., 0] == 0
    assert hit.sum() > 50
    assert np.abs(distance[..., 0] * cosine / size - 4)[hit].max() <= CLOSE


def test_a_square_far_from_the_origin_is_seen_as_sharply_as_one_near_it(embree):
    away = (1e6, -2e6, 3e6)
    near = looking_down(height=5)
    far = replace(near, eye=(1e6, -2e6, 3e6 + 5), target=away)
    here, there = level(1.5, 0.0), compose(translation(*away), level(1.5, 0.0))

    (seen,) = answer(embree, Scene(camera=near, shapes=(Square(albedo=WHITE, to_world=here),)), Stage.OBJECT)
    (seen_there,) = answer(embree, Scene(camera=far, shapes=(Square(albedo=WHITE, to_world=there),)), Stage.OBJECT)

    assert seen.any()
    assert np.array_equal(seen, seen_there)
