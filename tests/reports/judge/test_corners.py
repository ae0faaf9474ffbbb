"""Renderers that place corners in world space turn a face by its corners' rounding, and by no more are they excused."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Square, Triangle, Vector
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.forward.limits import WHOLE
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import ITEMS, ORACLE, witness

GREY = (0.5, 0.4, 0.3)
TURN = np.linalg.qr(np.array([(1.0, 2.0, 3.0), (-2.0, 1.0, 0.5), (0.3, -1.0, 2.0)]))[0]
FAR = 500 * np.array([0.94, 0.28, -0.19])
TURNED = TURN if np.linalg.det(TURN) > 0 else -TURN


def placed(linear: np.ndarray, shift: np.ndarray) -> Any:
    """Return a model matrix."""
    rows = np.eye(4)
    rows[:3, :3], rows[:3, 3] = linear, shift
    return tuple(tuple(map(float, row)) for row in rows)


def point(vector: np.ndarray) -> Vector:
    """Return a vector as plain numbers."""
    x, y, z = map(float, vector)
    return x, y, z


SQUARE = Square(albedo=GREY, to_world=placed(TURNED * 0.3, FAR))
CUBE = Cube(albedo=GREY, to_world=placed(TURNED * 0.3, FAR))
# Its middle pixel shows the origin, where the hit's own coordinates say nothing of the corners'.
TRIANGLE = Triangle(
    albedo=GREY, vertices=((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 2.0, 0.0)), to_world=placed(TURNED, np.zeros(3))
)


def case_of(shape) -> Case:
    """Return a case of a shape seen from its own third axis, a little aside, with a light beside the eye."""
    middle = np.asarray(shape.to_world)[:3, 3]
    size = 3 * np.linalg.norm(np.asarray(shape.to_world)[:3, 0])
    eye = point(middle + size * TURNED @ (0.1, 0.2, 1.0))
    camera = Camera(
        eye=eye, target=point(middle), up=point(TURNED[:, 1]), fovy=15, width=9, height=7,
        near=0.01, far=100,
    )  # fmt: skip
    light = PointLight(position=point(middle + size * TURNED @ (0.4, -0.2, 0.9)), flux=(10.0, 8.0, 6.0))
    return Case(
        name="test/corners", scene=Scene(camera=camera, shapes=(shape,), lights=(light,)), stresses="Corners.",
        covers=("NRM-3",), least_interior=1, most_explained=0.9,
    )  # fmt: skip


def normal_by_corners(shape) -> np.ndarray:
    """Return the normal of the face that is seen, by corners rounded to float32."""
    if isinstance(shape, Triangle):
        corners = world_triangles(shape)[0]
    else:
        height = 0.5 if isinstance(shape, Cube) else 0.0
        local = np.array([(-0.5, -0.5, height), (0.5, -0.5, height), (0.5, 0.5, height)])
        corners = local @ np.asarray(shape.to_world)[:3, :3].T + np.asarray(shape.to_world)[:3, 3]
    a, b, c = corners.astype(np.float32).astype(np.float64)
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal)


def judged_normal(shape, name: str, precision: str, turned: float) -> Outcome:
    """Judge a right renderer before one whose normals are by rounded corners, `turned` times as far from the right."""
    case = case_of(shape)
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    hit = truth[Stage.OBJECT][..., :1] >= 0
    off = np.where(hit, truth[Stage.NORMAL] + turned * (normal_by_corners(shape) - truth[Stage.NORMAL]), 0.0)
    other = dict(truth) | {Stage.NORMAL: off}
    mine = Answers(name="float64", precision="float64", items=ITEMS, answers=truth)
    result = judge_case(
        case, [mine], [witness(dict(truth)), witness(other, name=name, precision=precision)], ORACLE, {}
    )
    return next(one for one in result.checks if (one.reference, one.stage) == (name, Stage.NORMAL)).outcome


@pytest.mark.parametrize(
    ("shape", "name", "precision"),
    [
        pytest.param(SQUARE, "mitsuba_scalar", "float32", id="square-far-away"),
        pytest.param(CUBE, "mitsuba_scalar", "float32", id="cube-far-away"),
        pytest.param(TRIANGLE, "radiance", "float64", id="triangle-about-the-origin"),
    ],
)
def test_a_face_may_turn_by_its_corners_rounding_and_by_no_more(shape, name, precision):
    assert judged_normal(shape, name, precision, 1.0) is Outcome.PASS
    assert judged_normal(shape, name, precision, 100.0) is not Outcome.PASS


def test_who_keeps_a_square_in_its_own_space_has_no_such_allowance():
    assert judged_normal(SQUARE, "certified", "float64", 1.0) is not Outcome.PASS


def test_a_ray_that_hits_where_the_right_one_misses_is_blamed_for_nothing_that_follows():
    case = case_of(replace(SQUARE, to_world=placed(TURNED * 0.3, np.zeros(3))))
    scene = replace(case.scene, camera=replace(case.scene.camera, fovy=40.0))
    case = replace(case, scene=scene)
    truth = ORACLE.render(scene, stages_of(scene))
    ours = dict(truth)
    ours[Stage.RAY] = np.roll(truth[Stage.RAY], 2, axis=1)
    stages = list(Stage)
    for stage in stages[stages.index(Stage.OBJECT) :]:
        # As a renderer computes them, in numbers of its own: away from the oracle's by a rounding.
        ours[stage] = ORACLE.continue_from(scene, stage, ours) * (1.0 if stage in WHOLE else 1 + 2.0**-52)
    mine = Answers(name="float64", precision="float64", items=ITEMS, answers=ours)

    result = judge_case(case, [mine], [witness(truth)], ORACLE, {})

    assert np.any((truth[Stage.OBJECT][..., 0] < 0) & (ours[Stage.OBJECT][..., 0] >= 0))
    assert [check.stage for check in result.checks if check.alone] == [Stage.RAY]
