"""The everyday oracle against its certified witness, digit by digit and decision by decision."""

from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.double_double import DoubleDouble
from rayproof.reference.double_double.arithmetic import LOW_MARGIN
from tests.reference.analytic.scenes import camera, icosphere, looking_down, matrix, random_scene

ORACLE: Any = DoubleDouble()
WITNESS: Any = REFERENCES["certified"]()
GREY = (0.5, 0.25, 0.125)
NUMBERS = [stage for stage in IMAGE_STAGES if stage not in {Stage.OBJECT, Stage.VISIBILITY}]


def simple_scene(**changes: Any) -> Scene:
    """Return one primitive of each simple kind, placed at an angle, under two lights."""
    generator = np.random.default_rng(3)
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    squeezed = matrix(turn @ np.diag([1, 1.2, 0.7]), (1.2, 0, 0))
    shapes = (
        Plane(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, -0.7))),
        Sphere(albedo=GREY, center=(0.1, 0.2, 0.0), radius=0.6, to_world=squeezed),
        Cube(albedo=GREY, two_sided=True, to_world=matrix(turn, (-1.1, 0.3, 0.2))),
        Square(albedo=GREY, two_sided=True, to_world=matrix(turn.T, (0.2, 1.5, 0.9))),
        Triangle(albedo=GREY, vertices=((0.0, -1.0, 1.0), (0.5, 0.2, 1.2), (-0.4, 0.1, 1.6))),
    )
    lights = tuple(PointLight(position=place, flux=(9.0, 4.0, 1.0)) for place in ((2.0, -3.0, 4.0), (-3.0, 1.0, 2.0)))
    return Scene(camera=camera(width=64, height=48), shapes=shapes, lights=lights, **changes)


def mesh_scene() -> Scene:
    return Scene(
        camera=looking_down(4, fovy=40),
        shapes=(Plane(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, -1.5))), icosphere(2, two_sided=True)),
        lights=(PointLight(position=(1.5, 2.0, 4.0), flux=(9.0, 4.0, 1.0)),),
        clip="none",
    )


SCENES = {
    "depth": simple_scene(),
    "shell": simple_scene(clip="shell"),
    "simplified": simple_scene(shading="simplified"),
    "mesh": mesh_scene(),
    "crowd": random_scene(7),
}


def points_in(scene: Scene, count: int) -> np.ndarray:
    return np.random.default_rng(11).uniform((0, 0), (scene.camera.width, scene.camera.height), (count, 2))


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
def test_all_digits_and_every_decision_agree_with_the_certified_ones(scene: Scene) -> None:
    points = points_in(scene, 250)

    found = ORACLE.pairs(scene, IMAGE_STAGES, points)
    high, low = WITNESS.pairs(scene, IMAGE_STAGES, points)

    assert np.array_equal(found.high[Stage.OBJECT], high[Stage.OBJECT])
    assert np.array_equal(found.high[Stage.VISIBILITY], high[Stage.VISIBILITY])
    for stage in NUMBERS:
        known = np.isfinite(high[stage])
        assert np.array_equal(known, np.isfinite(found.high[stage]))
        size = np.where(known, np.abs(high[stage]), 0).max(axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):  # inf - inf on a miss
            error = np.abs((found.high[stage] - high[stage]) + (found.low[stage] - low[stage]))
        assert (error[known] <= (1e-28 * np.broadcast_to(size, error.shape))[known]).all()
    assert (found.margin > LOW_MARGIN).all()


@pytest.mark.parametrize("name", ["depth", "mesh"])
def test_stage_truth_agrees_with_the_certified_one(name: str) -> None:
    scene = SCENES[name]
    received = {
        stage: values.astype(np.float32).astype(np.float64)
        for stage, values in ORACLE.render(scene, IMAGE_STAGES).items()
    }

    for stage in IMAGE_STAGES:
        given = {name: received[name] for name in IMAGE_STAGES[: IMAGE_STAGES.index(stage)]}
        found, truth = ORACLE.continue_from(scene, stage, given), WITNESS.continue_from(scene, stage, given)
        assert found.shape == truth.shape
        assert found == pytest.approx(truth, rel=1e-15, abs=1e-25)


def test_a_tie_has_a_low_margin_and_its_neighbours_do_not() -> None:
    view = looking_down(4, fovy=90.0)
    scene = Scene(camera=view, shapes=(Square(albedo=GREY, to_world=matrix(np.eye(3), (0.5, 0, 0))),))
    points = np.array([[7.5, 5.5], [7.6, 5.6], [7.4, 5.6]])

    found = ORACLE.pairs(scene, [Stage.OBJECT], points)

    assert (found.margin < LOW_MARGIN).tolist() == [True, False, False]
    assert found.high[Stage.OBJECT][1:, 0].tolist() == [0, -1]


@pytest.mark.parametrize("fovy", [33.0, 50.0, 77.0])
def test_a_ray_that_is_parallel_but_for_roundings_has_a_low_margin(fovy: float) -> None:
    view = camera(eye=(0.0, 0.1, 0.3), target=(-2.3, 1.7, 0.3), up=(0.0, 0.1, -1.0), fovy=fovy, width=7, height=5)
    scene = Scene(camera=view, shapes=(Plane(albedo=GREY),), clip="none")

    found = ORACLE.pairs(scene, [Stage.OBJECT], np.array([[3.5, 2.5], [3.5, 2.6]]))

    assert (found.margin < LOW_MARGIN).tolist() == [True, False]


def test_a_light_in_the_plane_that_it_would_light_has_a_low_margin() -> None:
    floor = Plane(albedo=GREY, to_world=matrix(np.eye(3), (0.0, 0.0, -0.5)))
    view = camera(eye=(0.0, 0.0, 1.5), target=(2.0, -1.5, 1.0), up=(1.5, 0.5, -2.0), fovy=90.0, width=8, height=17)
    low, high = (PointLight(position=(0.5, 1.0, z), flux=(1.0, 1.0, 1.0)) for z in (-0.5, 0.25))
    points = points_in(Scene(camera=view, shapes=()), 60)
    seen = ORACLE.at(Scene(camera=view, shapes=(floor,)), [Stage.OBJECT], points)[Stage.OBJECT][:, 0] == 0

    in_it, above = (
        ORACLE.pairs(Scene(camera=view, shapes=(floor,), lights=(light,)), [Stage.VISIBILITY], points[seen]).margin
        for light in (low, high)
    )

    assert seen.any()
    assert (in_it < LOW_MARGIN).all()
    assert (above > LOW_MARGIN).all()


def test_a_mesh_of_triangles_without_area_is_not_there() -> None:
    mesh = Mesh(albedo=GREY, vertices=np.eye(3), faces=np.array([[0, 1, 1], [2, 2, 2]]))
    floor = Plane(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, -1.5)))
    light = PointLight(position=(1.5, 2.0, 4.0), flux=(9.0, 4.0, 1.0))
    one, other = (
        ORACLE.render(Scene(camera=looking_down(4), shapes=shapes, lights=(light,)), IMAGE_STAGES)
        for shapes in ((floor, mesh), (floor,))
    )

    for stage in IMAGE_STAGES:
        np.testing.assert_array_equal(one[stage], other[stage])


def test_inside_a_sphere_a_light_outside_is_dark_and_one_inside_lights_all() -> None:
    shape = Sphere(albedo=GREY, two_sided=True, radius=3.0)
    lights = tuple(PointLight(position=place, flux=(1.0, 1.0, 1.0)) for place in ((1.0, 0.5, 0.2), (9.0, 0.5, 0.2)))
    view = camera(eye=(0.1, 0.2, -0.3), target=(1.0, 0.0, 0.0), fovy=100.0, near=0.01)

    found = ORACLE.render(Scene(camera=view, shapes=(shape,), lights=lights), [Stage.OBJECT, Stage.VISIBILITY])

    assert (found[Stage.OBJECT] == 0).all()
    assert (found[Stage.VISIBILITY] == (1, 0)).all()


def test_the_camera_stage_agrees_with_the_certified_one() -> None:
    scene = random_scene(2)

    found, truth = (one.render(scene, [Stage.CAMERA])[Stage.CAMERA] for one in (ORACLE, WITNESS))

    for name, values in truth.items():
        assert found[name] == pytest.approx(values, rel=2e-16, abs=1e-30)
