"""What rtrace meets along the rays that it is handed, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Sphere, Square
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
    unit_sphere_roots,
)

# rtrace intersects in float64, in coordinates of some metres: a hundred roundings of ten.
CLOSE = 1000 * 2.0**-53
TURNED = ((0.0, -1.6, 0.0, 0.3), (1.6, 0.0, 0.0, 0.1), (0.0, 0.0, 1.6, 0.2), (0.0, 0.0, 0.0, 1.0))


def largest_coordinate(points):
    axis = np.abs(points).argmax(-1)
    return np.eye(3)[axis] * np.sign(np.take_along_axis(points, axis[..., None], -1))


def test_a_miss_has_the_values_that_the_specification_gives_it(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=WHITE, center=(0, 0, 9)),))

    shape, distance, position, normal = answer(radiance, scene, *HIT)

    assert np.all(shape == -1)
    assert np.all(distance == np.inf)
    assert not position.any()
    assert not normal.any()


@pytest.mark.parametrize("to_world", [IDENTITY, TURNED], ids=["unit", "turned-and-scaled"])
def test_a_sphere_is_where_geometry_says_and_its_normals_point_outward(radiance, to_world):
    first, _, depth = unit_sphere_roots(GENERIC, to_world)
    clear = depth > 0.01
    scene = Scene(camera=GENERIC, shapes=(Sphere(albedo=WHITE, to_world=to_world),))

    shape, distance, position, normal = answer(radiance, scene, *HIT)

    expected = GENERIC.eye + first[..., None] * directions(GENERIC)[:, :, 0]
    assert clear.sum() > 100
    assert np.array_equal(shape[..., 0] == 0, depth > 0)
    assert np.abs(distance[..., 0] - first)[clear].max() <= CLOSE
    assert np.abs(position - expected)[clear].max() <= CLOSE
    outward = gradient_normals(to_world, expected, lambda local: local)
    assert np.abs(normal - outward)[clear].max() <= 10 * CLOSE


@pytest.mark.parametrize("to_world", [IDENTITY, SHEARED, MIRRORED], ids=["unit", "sheared", "mirrored"])
def test_a_cube_has_one_face_index_and_outward_normals(radiance, to_world):
    scene = Scene(camera=GENERIC, shapes=(Cube(albedo=WHITE, to_world=to_world),))

    shape, distance, position, normal = answer(radiance, scene, *HIT)

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


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("kind", [Square, Plane])
def test_a_flat_shape_seen_from_behind_turns_its_normal_only_if_two_sided(radiance, kind, two_sided):
    camera = replace(looking_down(height=5), eye=(0.2, -0.1, -5))
    scene = Scene(camera=camera, shapes=(kind(albedo=WHITE, two_sided=two_sided, to_world=MIRRORED),))

    shape, normal = answer(radiance, scene, Stage.OBJECT, Stage.NORMAL)

    hit = shape[..., 0] == 0
    outward = np.linalg.inv(MIRRORED)[2, :3]
    outward /= np.linalg.norm(outward)
    assert hit.any()
    assert np.abs(normal[hit] - (-outward if two_sided else outward)).max() <= CLOSE


def test_a_mesh_tells_its_faces_apart_and_skips_those_without_area(radiance):
    vertices = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float32)
    faces = np.array([(0, 0, 1), (0, 1, 2), (1, 1, 1), (0, 2, 3)])
    scene = Scene(camera=looking_down(height=5, fovy=35), shapes=(Mesh(albedo=WHITE, vertices=vertices, faces=faces),))

    shape, position = answer(radiance, scene, Stage.OBJECT, Stage.POSITION)

    apart = position[..., 0] - position[..., 1]
    clear = (shape[..., 0] == 0) & (np.abs(apart) > 1e-3)
    assert clear.sum() > 100
    assert np.array_equal(shape[clear, 1], np.where(apart[clear] > 0, 1, 3))


@pytest.mark.parametrize(
    ("clip", "seen"), [("depth", 1.0), ("shell", None), ("none", 0.0)], ids=["depth", "shell", "none"]
)
def test_what_is_clipped_lets_see_what_is_behind(radiance, clip, seen):
    # Layers at z = 4 and z = 0, from a height of 5: in front of the near plane, and behind it.
    upper = ((3.0, 0, 0, 0), (0, 3.0, 0, 0), (0, 0, 1, 4.0), (0, 0, 0, 1.0))
    lower = ((9.0, 0, 0, 0), (0, 9.0, 0, 0), (0, 0, 1, 0.0), (0, 0, 0, 1.0))
    camera = looking_down(height=5, near=1.01, far=5.2, fovy=30)
    shapes = (Square(albedo=WHITE, to_world=upper), Square(albedo=WHITE, to_world=lower))

    shape, distance = answer(radiance, Scene(camera=camera, shapes=shapes, clip=clip), Stage.OBJECT, Stage.DISTANCE)

    cosine = -directions(camera)[:, :, 0, 2]
    expected = np.full(cosine.shape, seen) if seen is not None else np.where(1 / cosine > 1.01, 0.0, 1.0)
    assert np.array_equal(shape[..., 0], expected)
    assert np.abs(distance[..., 0] - np.where(expected == 0, 1, 5) / cosine).max() <= CLOSE


@pytest.mark.parametrize("size", [1e-30, 1e-6, 1e6, 1e30])
def test_the_size_of_a_scene_costs_no_digits(radiance, size):
    matrix = ((size, 0, 0, 0), (0, size, 0, 0), (0, 0, size, 0), (0, 0, 0, 1.0))
    camera = looking_down(height=5 * size, near=0.1 * size, far=10 * size)
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE, to_world=matrix),))

    (distance,) = answer(radiance, scene, Stage.DISTANCE)

    first, _, depth = unit_sphere_roots(looking_down(height=5, near=0.1, far=10), IDENTITY)
    clear = depth > 0.01
    assert np.abs(distance[..., 0] / size - first)[clear].max() <= CLOSE
