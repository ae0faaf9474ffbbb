"""Closed forms, and what must hold between the stages of the analytic reference."""

from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.surfaces import surface_of
from tests.reference.analytic.scenes import camera, icosphere, looking_down, matrix, random_scene

ORACLE: Any = Analytic()
GREY = (0.5, 0.25, 0.125)
CENTER = (5, 7)  # row, column of the central pixel of `looking_down`


def test_a_sphere_on_the_axis():
    scene = Scene(camera=looking_down(4), shapes=(Sphere(albedo=GREY, radius=1.5),))

    found = ORACLE.render(scene, IMAGE_STAGES)

    assert found[Stage.DISTANCE][CENTER] == pytest.approx(2.5, rel=1e-15)
    assert found[Stage.NORMAL][CENTER] == pytest.approx((0, 0, 1), abs=1e-15)
    assert tuple(found[Stage.OBJECT][CENTER]) == (0, 0)
    assert tuple(found[Stage.OBJECT][0, 0]) == (-1, -1)
    assert found[Stage.DISTANCE][0, 0] == np.inf
    assert not found[Stage.POSITION][0, 0].any()
    assert found[Stage.VISIBILITY].shape == (11, 15, 0)


def test_a_scene_has_the_faces_of_its_shapes_and_no_other():
    mesh = Mesh(albedo=GREY, vertices=np.eye(4)[:, :3], faces=np.array(((0, 1, 2), (0, 2, 3))))
    scene = Scene(camera=looking_down(4), shapes=(Sphere(albedo=GREY), mesh))
    there = [(0, 0), (1, 0), (1, 1)]
    not_there = [(0, 1), (1, 2), (1, -1), (2, 0), (-1, -1), (0.5, 0), (1, 0.5), (np.nan, 0), (1, np.nan)]

    assert ORACLE.known(scene, np.array(there + not_there)).tolist() == [True] * 3 + [False] * 9


def test_inverse_square_and_cosine():
    light = PointLight(position=(3.0, 0.0, 4.0), flux=(4 * np.pi, 8 * np.pi, 0))
    scene = Scene(camera=looking_down(2), shapes=(Plane(albedo=GREY),), lights=(light,))

    found = ORACLE.render(scene, IMAGE_STAGES)

    expected = np.array([1, 2, 0]) / 25 * 4 / 5
    assert found[Stage.IRRADIANCE][CENTER] == pytest.approx(expected, rel=1e-14)
    assert found[Stage.RADIANCE][CENTER] == pytest.approx(expected * GREY / np.pi, rel=1e-14)


def test_simplified_lights_have_no_falloff_and_add_without_a_clamp():
    lights = tuple(PointLight(position=(0.0, 0.0, height), flux=(1.0, 2.0, 3.0)) for height in (4.0, 40.0))
    scene = Scene(camera=looking_down(2), shapes=(Plane(albedo=GREY),), lights=lights, shading="simplified")

    found = ORACLE.render(scene, IMAGE_STAGES)

    assert found[Stage.RADIANCE][CENTER] == pytest.approx(np.array([2, 4, 6]) * GREY, rel=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_continuing_from_its_own_answers_changes_nothing(seed):
    scene = random_scene(seed)
    found = ORACLE.render(scene, IMAGE_STAGES)

    for stage in IMAGE_STAGES:
        earlier = {name: found[name] for name in IMAGE_STAGES[: IMAGE_STAGES.index(stage)]}
        assert np.array_equal(ORACLE.continue_from(scene, stage, earlier), found[stage]), stage


@pytest.mark.parametrize("seed", range(4))
def test_continuing_from_float32_sees_no_acne(seed):
    """A position rounded to float32 lies off its surface; only pixels at an edge may change sides."""
    scene = random_scene(seed)
    found = ORACLE.render(scene, IMAGE_STAGES)
    rounded = {stage: image.astype(np.float32) for stage, image in found.items()}

    again = ORACLE.continue_from(scene, Stage.VISIBILITY, rounded)

    assert (again != found[Stage.VISIBILITY]).mean() < 5e-4


@pytest.mark.parametrize("seed", range(3))
def test_normals_are_orthogonal_to_differenced_tangents(seed):
    scene = random_scene(seed)
    centers = np.random.default_rng(seed).uniform((0, 0), (40, 30), (200, 2))
    step = 1e-5
    stages = [Stage.OBJECT, Stage.POSITION, Stage.NORMAL]
    here, right, below = (ORACLE.at(scene, stages, centers + offset) for offset in ((0, 0), (step, 0), (0, step)))

    same = (here[Stage.OBJECT][:, 0] >= 0) & (right[Stage.OBJECT] == here[Stage.OBJECT]).all(axis=1)
    for there in (right, below):
        tangent = (there[Stage.POSITION] - here[Stage.POSITION])[same]
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        slip = np.abs((tangent * here[Stage.NORMAL][same]).sum(axis=1))
        # One pixel in fifty may lie across a cube's edge or where an outline makes the surface curve away.
        assert np.quantile(slip, 0.98) < 1e-3


ENCLOSURES = [
    pytest.param(Sphere(albedo=GREY, radius=3, two_sided=True), id="sphere"),
    pytest.param(Cube(albedo=GREY, to_world=matrix(np.diag([5, 6, 7])), two_sided=True), id="cube"),
    pytest.param(icosphere(1, to_world=matrix(np.eye(3) * 3), two_sided=True), id="mesh"),
]


@pytest.mark.parametrize("shape", ENCLOSURES)
def test_inside_a_closed_surface_an_inner_light_reaches_all_and_an_outer_one_nothing(shape):
    lights = (PointLight(position=(0.4, 0.2, -0.3), flux=(1, 1, 1)), PointLight(position=(1, -9, 2), flux=(1, 1, 1)))
    scene = Scene(camera=camera(eye=(0.2, 0.3, 0.1), target=(1, 2, 1), fovy=100), shapes=(shape,), lights=lights)

    found = ORACLE.render(scene, IMAGE_STAGES)

    assert (found[Stage.OBJECT][..., 0] == 0).all()
    assert (found[Stage.VISIBILITY][..., 0] == 1).all()
    assert not found[Stage.VISIBILITY][..., 1].any()


def test_a_one_sided_surface_is_black_from_behind_though_light_falls_on_it():
    light = PointLight(position=(0, 0, -2), flux=(1, 1, 1))
    flipped = matrix(np.diag([1, -1, -1]))
    for two_sided, where in ((False, -2), (False, 2), (True, -2), (True, 2)):
        lamp = PointLight(position=(0, 0, where), flux=light.flux)
        plane = Plane(albedo=GREY, to_world=flipped, two_sided=two_sided)
        found = ORACLE.render(Scene(camera=looking_down(3), shapes=(plane,), lights=(lamp,)), IMAGE_STAGES)
        # The plane faces down, the camera looks from above.
        assert found[Stage.IRRADIANCE][CENTER].any() == ((where > 0) == two_sided)
        assert found[Stage.RADIANCE][CENTER].any() == (two_sided and where > 0)


def test_a_blocker_behind_the_light_or_below_the_point_does_not_count():
    plane = Plane(albedo=GREY)
    light = PointLight(position=(0.3, 0.2, 1), flux=(1, 1, 1))
    for height, expected in ((2.0, 1), (0.5, 0), (-0.5, 1)):
        blocker = Sphere(albedo=GREY, radius=0.1, center=(0.3 * height, 0.2 * height, height))
        scene = Scene(camera=looking_down(1.5), shapes=(plane, blocker), lights=(light,))
        found = ORACLE.render(scene, IMAGE_STAGES)
        assert found[Stage.VISIBILITY][CENTER] == expected


def test_a_light_on_the_surface_gives_nothing_there():
    light = PointLight(position=(0, 0, 0), flux=(1, 1, 1))
    scene = Scene(camera=looking_down(2), shapes=(Plane(albedo=GREY),), lights=(light,))

    found = ORACLE.render(scene, IMAGE_STAGES)

    assert not found[Stage.VISIBILITY][CENTER].any()
    assert not found[Stage.IRRADIANCE][CENTER].any()


@pytest.mark.parametrize(("clip", "corner_hits"), [("depth", True), ("shell", False), ("none", True)])
def test_clip_modes_part_at_the_corners(clip, corner_hits):
    """A plane at depth 2 is 2.4 m away at the corner: beyond a shell of 2.1 m, within the far plane at 2.1 m."""
    scene = Scene(camera=looking_down(2, far=2.1), shapes=(Plane(albedo=GREY),), clip=clip)

    found = ORACLE.render(scene, [Stage.OBJECT])[Stage.OBJECT]

    assert found[CENTER][0] == 0
    assert (found[0, 0, 0] == 0) == corner_hits


def test_clipping_the_front_of_a_sphere_shows_its_back():
    scene = Scene(camera=looking_down(4, near=3.5), shapes=(Sphere(albedo=GREY),))

    found = ORACLE.render(scene, [Stage.DISTANCE])[Stage.DISTANCE]

    assert found[CENTER] == pytest.approx(5)


def test_equal_distances_go_to_the_lower_index():
    twice = (Square(albedo=GREY), Square(albedo=GREY))

    found = ORACLE.render(Scene(camera=looking_down(2), shapes=twice), [Stage.OBJECT])[Stage.OBJECT]

    assert found[CENTER][0] == 0


def test_a_ray_through_an_edge_of_two_faces_hits_one_of_them():
    mesh = icosphere(2)
    scene = Scene(camera=camera(), shapes=(mesh,))
    eye, faces = np.asarray(scene.camera.eye), mesh.vertices.astype(np.float64)[mesh.faces]
    front = faces[(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]) * (eye - faces[:, 0])).sum(1) > 0.2]
    steps = np.random.default_rng(0).uniform(0, 1, (len(front), 1))
    on_edges = front[:, 0] + steps * (front[:, 1] - front[:, 0])
    targets = np.concatenate([on_edges, front[:, 2]]) - eye
    rays = (targets / np.linalg.norm(targets, axis=1, keepdims=True))[: 24 * 18]
    image = np.zeros((24 * 18, 3))
    image[:] = rays[0]
    image[: len(rays)] = rays

    found = ORACLE.continue_from(scene, Stage.OBJECT, {Stage.RAY: image.reshape(18, 24, 3)})

    assert (found[..., 0] == 0).all()


def test_overflow_is_infinite_and_never_nan():
    light = PointLight(position=(0, 0, 1e-200), flux=(1, 0, 1))
    plane = Plane(albedo=(0.0, 1.0, 1.0))
    scene = Scene(camera=looking_down(2), shapes=(plane,), lights=(light,))

    found = ORACLE.render(scene, IMAGE_STAGES)

    assert tuple(found[Stage.IRRADIANCE][CENTER]) == (np.inf, 0, np.inf)
    assert tuple(found[Stage.RADIANCE][CENTER]) == (0, 0, np.inf)


def test_samples_are_the_mean_over_a_subdivided_pixel():
    scene = random_scene(1, width=6, height=4)
    rows, columns = np.mgrid[:4, :6]

    found = ORACLE.render(scene, [Stage.RADIANCE], samples=3)[Stage.RADIANCE]

    means = np.zeros((4, 6, 3))
    for down in (1 / 6, 3 / 6, 5 / 6):
        for across in (1 / 6, 3 / 6, 5 / 6):
            points = np.stack([columns + across, rows + down], axis=-1).reshape(-1, 2)
            means += ORACLE.at(scene, [Stage.RADIANCE], points)[Stage.RADIANCE].reshape(4, 6, 3) / 9
    assert found == pytest.approx(means, rel=1e-12)


def test_camera_matrices_agree_with_the_rays():
    scene = Scene(camera=camera(), shapes=())
    answer = ORACLE.render(scene, [Stage.CAMERA])[Stage.CAMERA]
    identity = np.eye(4)

    assert answer["view"] @ answer["view_inverse"] == pytest.approx(identity, abs=1e-14)
    assert answer["projection"] @ answer["projection_inverse"] == pytest.approx(identity, abs=1e-12)
    corners = np.concatenate([answer["frustum_corners"], np.ones((8, 1))], axis=1)
    clip = corners @ (answer["projection"] @ answer["view"]).T
    expected = [(sx, sy, z) for z in (0, 1) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    assert clip[:, :3] / clip[:, 3:] == pytest.approx(np.array(expected, dtype=float), abs=1e-12)
    assert answer["ndc"][0, 0] == pytest.approx((1 / 24 - 1, 1 - 1 / 18))
    assert answer["pixel"][3, 4] == pytest.approx((4.5, 3.5))
    directions = ORACLE.render(scene, [Stage.RAY])[Stage.RAY]
    seen = (scene.camera.eye + directions[3, 4] * 5) @ answer["view"][:3, :3].T + answer["view"][:3, 3]
    projected = answer["projection"] @ [*seen, 1]
    assert projected[:2] / projected[3] == pytest.approx(answer["ndc"][3, 4])


def test_a_hit_beside_a_cubes_edge_is_on_the_face_whose_normal_it_has():
    cube, turn = Cube(albedo=GREY), np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    surface = surface_of(Cube(albedo=cube.albedo, to_world=matrix(turn * 3.7, (120.3, -70.1, 33.7))))
    generator = np.random.default_rng(4)
    ends = np.column_stack([np.full((2000, 2), 0.5), generator.uniform(-0.5, 0.5, 2000)])
    places = ends @ (turn * 3.7).T + (120.3, -70.1, 33.7)
    eye = np.array((3.0, 4.0, 0.3)) @ (turn * 3.7).T + (120.3, -70.1, 33.7)
    rays = places - eye

    found = surface.first(eye, rays, np.zeros(2000), np.full(2000, np.inf))

    hit = np.isfinite(found.distance)
    outward = surface.outward(eye + found.distance[hit, np.newaxis] * rays[hit], found.face[hit])
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile((-1.0, 1.0), 3)[:, np.newaxis] @ turn.T
    assert np.count_nonzero(hit) > 500
    assert len(np.unique(found.piece[hit])) == 2
    np.testing.assert_allclose(outward, normals[found.piece[hit]], atol=1e-12)
