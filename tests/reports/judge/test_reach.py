"""How far rounding reaches: not so far that what it cannot change is left undecided."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Cube, Plane, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reports.judge.forward.conditioning import (
    basis_condition,
    facing,
    ray_condition,
)
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.shrinking.failure import judged, renderer
from rayproof.reports.subjects import THE_TRACER
from rayproof.tracer.configuration import Configuration
from tests.reports.judge.scenes import CAMERA, ORACLE, SCENE, against, kind, put, truth_of_scene


@pytest.mark.parametrize("fovy", [120.0, 170.0, 179.0])
def test_the_axes_error_turns_no_ray_of_a_wide_view_much_farther_than_themselves(fovy):
    camera = replace(CAMERA, eye=(300.0, 400.0, 500.0), target=(300.1, 400.1, 500.0), fovy=fovy)
    generator, worst = np.random.default_rng(1), 0.0
    for _ in range(1000):
        a, b = math.tan(camera.alpha) * generator.uniform(-1, 1, 2) * (camera.aspect, 1)
        axes = np.eye(3) + 1e-7 * generator.uniform(-1, 1, (3, 3))
        exact, off = np.array([a, b, 1.0]), axes @ [a, b, 1.0]
        turned = np.linalg.norm(np.cross(exact, off)) / np.linalg.norm(exact) / np.linalg.norm(off)
        worst = max(worst, turned / 1e-7 / math.sqrt(3))  # an axis is off by sqrt(3) 1e-7 at most

    assert worst <= 2
    assert ray_condition(camera, np.linspace(0, 1, 9)).max() <= 2.1 * basis_condition(camera)


def terms_of(name):
    """Return what is said of a faultless float32 renderer in a random scene."""
    (case,) = select([name])
    return against(case.scene, truth_of_scene(case.scene).truth)


@pytest.mark.parametrize("name", ["random/1/247", "random/1/207"])
def test_where_a_squeezed_sphere_is_flat_its_normal_is_known(name):
    pair = terms_of(name)
    squeezed = pair.base.conditioning.matrix > 300

    assert squeezed.mean() > 0.5
    assert pair.limits.end_to_end[Stage.NORMAL][squeezed].max() < 1e-2


def test_where_two_surfaces_coincide_a_position_is_not_excused_by_its_neighbourhood():
    # At a cube's edge as thin as rounding a position was off by a thousandth.
    (case,) = select(["random/2/159"])
    pixel, truth = (3, 15), truth_of_scene(case.scene).truth
    answers = dict(truth) | {Stage.POSITION: put(truth[Stage.POSITION], pixel, 1.001 * truth[Stage.POSITION][pixel])}

    assert kind(case.scene, answers, Stage.POSITION, pixel) is Kind.WRONG


def test_without_clipping_each_ray_sees_the_surface_at_the_eye_or_what_lies_beyond():
    # The ray by itself decides, so that neighbours need not agree: random/61304/154 and random/61302/140.
    matrix = np.array([[0.6, 0.3, 0.5, 0], [-0.2, 0.7, 0.4, 0], [-0.3, -0.4, 0.8, 0], [0, 0, 0, 1]])
    matrix[:3, 3] = CAMERA.eye
    square = Square(albedo=(0.2, 0.5, 0.8), to_world=tuple(map(tuple, matrix.tolist())), two_sided=True)
    scene = replace(SCENE, shapes=(*SCENE.shapes, square), clip="none")
    answers = {stage: np.array(image) for stage, image in truth_of_scene(scene).truth.items()}
    every_other = np.indices((CAMERA.height, CAMERA.width)).sum(axis=0) % 2 == 0
    answers[Stage.OBJECT][every_other] = 2.0, 0.0
    answers[Stage.DISTANCE][every_other] = 1e-7
    for stage in (Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
        answers[stage][every_other] = ORACLE.continue_from(scene, stage, answers)[every_other]

    def wrong(stage, **changed):
        spoilt = {Stage(name): image for name, image in changed.items()}
        return np.count_nonzero(against(scene, answers | spoilt).end_to_end[stage].wrong)

    assert answers[Stage.IRRADIANCE][every_other].any()
    assert [wrong(stage) for stage in stages_of(scene) if stage is not Stage.CAMERA] == [0] * 9
    assert wrong(Stage.IRRADIANCE, irradiance=1.01 * answers[Stage.IRRADIANCE]) > every_other.size / 4
    assert wrong(Stage.OBJECT, object=np.where(answers[Stage.OBJECT] == 1, 0, answers[Stage.OBJECT])) > 0


@pytest.mark.parametrize("kind", [Sphere, Cube, Square, Plane])
def test_the_plane_that_a_shape_turns_to_the_eye_is_where_its_surface_is(kind):
    matrix = ((2.0, 0.3, 0.0, 1.0), (0.0, 1.5, 0.2, -2.0), (0.1, 0.0, 0.7, 0.5), (0.0, 0.0, 0.0, 1.0))
    shape = kind(albedo=(0.5, 0.5, 0.5), to_world=matrix)
    local = np.array((0.0, 0.6, 0.8)) if kind is Sphere else np.array((0.2, -0.1, 0.5 if kind is Cube else 0.0))
    point = np.asarray(matrix)[:3, :3] @ local + np.asarray(matrix)[:3, 3]

    normals, offsets, _ = facing(shape, point)
    nearest = int(np.argmin(offsets))
    lifted = facing(shape, point + 1e-3 * normals[nearest])[1][nearest]

    assert offsets[nearest] < 1e-12
    assert lifted == pytest.approx(1e-3, rel=1e-2)


def test_a_hit_that_its_own_ray_misses_by_rounding_has_the_normals_limit_of_its_own_place():
    # In a random scene float32 hits the rim, its ray misses by less, and the limit of the normal was 0.
    rows = ((0.005787, -0.006356, -0.003409, 0.0), (0.0055, 0.86, -0.0032, 0.0), (0.004651, -5.3e-05, 0.007992, 0.0))
    sphere = Sphere(
        albedo=(1, 1, 1), center=(0.173515, 0.134847, 0.173515), radius=0.501975, to_world=(*rows, (0.0, 0.0, 0.0, 1.0))
    )
    camera = replace(
        CAMERA, eye=(-2.459708596056443, 0, -0.14891670418613706), target=(0.0004219, -0.015, -0.0022379),
        up=(0, 0, 1), fovy=1, width=3, height=3, near=1, far=100,
    )  # fmt: skip
    render = renderer(THE_TRACER, Configuration(precision="float32"))

    answered = judged(replace(SCENE, camera=camera, shapes=(sphere,), lights=()), render)

    assert answered is not None
    verdict, subject, truth = answered
    assert (subject.answers[Stage.OBJECT][1, 1, 0], truth[Stage.OBJECT][1, 1, 0]) == (0, -1)
    assert [check.reason for check in verdict.checks if check.outcome is Outcome.FAIL] == []
