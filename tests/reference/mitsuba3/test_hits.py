"""Rays, objects, faces, distances, positions and normals against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Sphere, Square, Triangle
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

# Mitsuba computes in float32; twenty roundings of numbers of size one cover what these well-placed scenes need.
CLOSE = 20 * 2.0**-24


def largest_coordinate(points):
    axis = np.abs(points).argmax(-1)
    return np.eye(3)[axis] * np.sign(np.take_along_axis(points, axis[..., None], -1))


def test_a_miss_has_the_values_that_the_specification_gives_it(mitsuba):
    behind = Sphere(albedo=WHITE, center=(0, 0, 9))
    scene = Scene(camera=looking_down(height=5), shapes=(behind,))

    shape, distance, position, normal = answer(mitsuba, scene, *HIT)

    assert np.all(shape == -1)
    assert np.all(distance == np.inf)
    assert not position.any()
    assert not normal.any()


def test_a_sphere_on_the_axis(mitsuba):
    camera = looking_down(height=5)
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE, radius=1.5),))

    distance, position, normal = answer(mitsuba, scene, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)

    middle = (camera.height // 2, camera.width // 2)
    assert distance[middle] == pytest.approx([3.5], rel=CLOSE)
    assert position[middle] == pytest.approx([0, 0, 1.5], abs=CLOSE)
    assert normal[middle] == pytest.approx([0, 0, 1], abs=CLOSE)


@pytest.mark.parametrize("near", [0.5, 3.0], ids=["near-plane-close", "near-plane-far-out"])
@pytest.mark.parametrize(
    "to_world",
    [IDENTITY, SHEARED, MIRRORED, ((-1.0, 0, 0, 0.4), *IDENTITY[1:])],
    ids=["unit", "sheared", "sheared-mirror", "mirror"],
)
def test_an_ellipsoid_is_where_geometry_says_and_its_normals_point_outward(mitsuba, to_world, near):
    camera = replace(GENERIC, near=near)
    first, _, depth = unit_sphere_roots(camera, to_world)
    clear = depth > 0.01  # the limb magnifies roundings
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE, to_world=to_world),))

    shape, distance, position, normal = answer(mitsuba, scene, *HIT)

    expected = camera.eye + first[..., None] * directions(camera)[:, :, 0]
    outward = gradient_normals(to_world, expected, lambda local: local)
    assert clear.sum() > 100
    assert np.array_equal(shape[..., 0] == 0, depth > 0)
    # Dividing by the depth's root is what the limb does to every rounding of the quadratic.
    assert (np.abs(distance[..., 0] - first)[clear] * np.sqrt(depth[clear])).max() <= 4 * CLOSE
    assert np.abs(position - expected)[clear].max() <= 40 * CLOSE
    assert np.abs(normal - outward)[clear].max() <= 40 * CLOSE


@pytest.mark.parametrize("to_world", [IDENTITY, SHEARED, MIRRORED], ids=["unit", "sheared", "mirrored"])
def test_a_cube_has_one_face_index_and_outward_normals(mitsuba, to_world):
    scene = Scene(camera=GENERIC, shapes=(Cube(albedo=WHITE, to_world=to_world),))

    shape, distance, position, normal = answer(mitsuba, scene, *HIT)

    hit = shape[..., 0] == 0
    inverse = np.linalg.inv(to_world)
    local = position @ inverse[:3, :3].T + inverse[:3, 3]
    ordered = np.sort(np.abs(local), axis=-1)
    clear = hit & (ordered[..., 1] < 0.49)
    assert clear.sum() > 40
    assert np.all(shape[hit, 1] == 0)
    assert np.abs(ordered[hit, 2] - 0.5).max() <= 4 * CLOSE
    assert np.abs(camera_points(distance)[hit] - position[hit]).max() <= 4 * CLOSE
    outward = gradient_normals(to_world, position[clear], largest_coordinate)
    assert np.abs(normal[clear] - outward).max() <= 4 * CLOSE
    assert np.all((normal * directions(GENERIC)[:, :, 0]).sum(-1)[hit] < 0)


def camera_points(distance):
    return GENERIC.eye + np.where(np.isfinite(distance), distance, 0) * directions(GENERIC)[:, :, 0]


@pytest.mark.parametrize("two_sided", [False, True], ids=["one-sided", "two-sided"])
@pytest.mark.parametrize("kind", [Square, Plane])
@pytest.mark.parametrize("to_world", [IDENTITY, SHEARED, MIRRORED], ids=["unit", "sheared", "mirrored"])
@pytest.mark.parametrize("side", [1, -1], ids=["from-above", "from-below"])
def test_flat_shapes_face_plus_z_in_their_own_space(mitsuba, kind, to_world, two_sided, side):
    eye = tuple(float(x) for x in np.array(to_world)[:3] @ (0.4, -0.7, 3.0 * side, 1.0))
    camera = replace(GENERIC, eye=eye)
    scene = Scene(camera=camera, shapes=(kind(albedo=WHITE, to_world=to_world, two_sided=two_sided),))

    shape, distance, position, normal = answer(mitsuba, scene, *HIT)

    inverse = np.linalg.inv(to_world)
    ray = directions(camera)[:, :, 0]
    local = (ray @ inverse[:3, :3].T)[..., 2]
    with np.errstate(divide="ignore"):
        expected = -3.0 * side / local
    point = (camera.eye + expected[..., None] * ray) @ inverse[:3, :3].T + inverse[:3, 3]
    outer = np.abs(point[..., :2]).max(-1)
    inside = (expected > 0) & ((outer < 0.5) if kind is Square else (expected < 20))
    facing = gradient_normals(to_world, position, lambda p: np.broadcast_to([0.0, 0.0, 1.0], p.shape))
    facing = -facing if two_sided and side < 0 else facing
    clear = inside & ((np.abs(outer - 0.5) > 1e-4) | (kind is Plane))
    assert clear.sum() > 20
    assert np.all(shape[clear] == 0)
    assert np.abs(distance[..., 0] / expected - 1)[clear].max() <= 4 * CLOSE
    assert np.abs(normal - facing)[clear].max() <= CLOSE


@pytest.mark.parametrize("mirror", [False, True], ids=["as-wound", "mirrored"])
def test_a_mesh_answers_with_its_own_face_numbers_although_faces_without_area_are_left_out(mitsuba, mirror):
    vertices = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    faces = [(0, 1, 1), (0, 1, 2), (0, 2, 2), (1, 1, 1), (0, 2, 3)]
    to_world = ((-1.0 if mirror else 1.0, 0, 0, 0), *IDENTITY[1:])
    mesh = Mesh(albedo=WHITE, vertices=np.array(vertices), faces=np.array(faces), to_world=to_world)
    sphere = Sphere(albedo=WHITE, center=(0, 0, -5))
    camera = looking_down(height=4)
    scene = Scene(camera=camera, shapes=(sphere, mesh))

    shape, position, normal = answer(mitsuba, scene, Stage.OBJECT, Stage.POSITION, Stage.NORMAL)

    here = shape[..., 0] == 1
    x = position[..., 0] * (-1 if mirror else 1)
    clear = here & (np.abs(x - position[..., 1]) > 1e-3)
    assert clear.sum() > 100
    assert np.array_equal(shape[clear, 1], np.where((x > position[..., 1])[clear], 1, 4))
    assert np.all(normal[here] == (0, 0, 1))


def test_a_triangle_has_face_zero_and_a_normal_by_its_winding(mitsuba):
    first, second, third = (-1, -1, 0), (1, -1, 0), (0, 1, 0)
    upward = Triangle(albedo=WHITE, vertices=(first, second, third))
    aside = ((1, 0, 0, 2.5), *IDENTITY[1:])
    downward = Triangle(albedo=WHITE, vertices=(third, second, first), to_world=aside)
    flat = Triangle(albedo=WHITE, vertices=((0, 0, 1), (1, 1, 1), (2, 2, 1)))
    scene = Scene(camera=looking_down(height=5, fovy=60), shapes=(flat, downward, upward))

    shape, normal = answer(mitsuba, scene, Stage.OBJECT, Stage.NORMAL)

    assert set(shape[..., 0].ravel()) == {-1, 1, 2}
    assert np.all(shape[shape[..., 0] >= 0, 1] == 0)
    assert np.all(normal[shape[..., 0] == 2] == (0, 0, 1))
    assert np.all(normal[shape[..., 0] == 1] == (0, 0, -1))


def test_the_nearest_of_all_kinds_keeps_its_own_index(mitsuba):
    def at(x, linear=1.0):
        return ((linear, 0, 0, x), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1.0))

    shapes = (
        Cube(albedo=WHITE, to_world=at(-2.0, -1.0)),
        Sphere(albedo=WHITE, radius=0.5, to_world=at(-1.0, 0.8)),
        Triangle(albedo=WHITE, vertices=((-0.4, -0.4, 0), (0.4, -0.4, 0), (0, 0.4, 0))),
        Square(albedo=WHITE, to_world=at(1.0, 0.8)),
        Sphere(albedo=WHITE, radius=0.4, to_world=at(2.0)),
        Plane(albedo=WHITE, to_world=((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -1), (0, 0, 0, 1))),
    )
    camera = looking_down(height=6, width=101, rows=31, fovy=30)
    scene = Scene(camera=camera, shapes=shapes)

    shape, position = answer(mitsuba, scene, Stage.OBJECT, Stage.POSITION)

    assert set(shape[..., 0].ravel()) == {0, 1, 2, 3, 4, 5}
    for index in range(5):
        assert np.abs(position[shape[..., 0] == index][:, 0].mean() - (index - 2)) < 0.2
