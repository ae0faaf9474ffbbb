"""Faces that coincide are other surfaces than the hit one: all oracles see past them alike, none names either alone."""

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.scene import Camera, Mesh, PointLight, Scene, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import ORACLE, candidate, rounded, witness

GREY = (0.5, 0.4, 0.3)
CORNERS = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.2), (0.0, 1.0, 0.1))
CAMERA = Camera(
    eye=(0.0, -3.0, 3.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), fovy=40, width=16, height=12, near=0.01, far=100
)
LIGHT = PointLight(position=(1.0, -2.0, 4.0), flux=(100.0, 80.0, 60.0))


def mesh(second: tuple[int, int, int]) -> Mesh:
    """Return a triangle and a second face on the same corners."""
    return Mesh(albedo=GREY, vertices=np.array(CORNERS, np.float32), faces=np.array([(0, 1, 2), second]))


SCENES = {
    "same-winding": (mesh((1, 2, 0)),),
    "other-winding": (mesh((0, 2, 1)),),
    "two-triangles": (Triangle(albedo=GREY, vertices=CORNERS), Triangle(albedo=GREY, vertices=CORNERS)),
    "two-spheres": (Sphere(albedo=GREY), Sphere(albedo=GREY)),
}

TRIANGLE, BALL = Triangle(albedo=GREY, vertices=CORNERS), Sphere(albedo=GREY)
ALONE = {name: (BALL,) if name == "two-spheres" else (TRIANGLE,) for name in SCENES}


def scene_of(shapes: tuple) -> Scene:
    """Return the shapes before the camera, under one light, with a ball beside them."""
    ball = Sphere(albedo=GREY, center=(-1.3, 0.6, 0.3), radius=0.5)
    return Scene(camera=CAMERA, shapes=(*shapes, ball), lights=(LIGHT,))


@pytest.mark.parametrize("name", SCENES)
def test_a_coincident_surface_blocks_no_shadow_ray(name):
    scene = scene_of(SCENES[name])
    asked = (Stage.OBJECT, Stage.VISIBILITY)

    ours = ORACLE.render(scene, asked)
    alone = REFERENCES["certified"]().render(scene_of(ALONE[name]), asked)

    first = (ours[Stage.OBJECT] == (0, 0)).all(axis=-1) & (alone[Stage.OBJECT][..., 0] == 0)
    assert alone[Stage.VISIBILITY][first].sum() > 15
    assert np.array_equal(ours[Stage.VISIBILITY][first], alone[Stage.VISIBILITY][first])


@pytest.mark.parametrize("name", ["same-winding", "other-winding"])
def test_of_two_faces_on_the_same_corners_either_may_be_named_and_no_third(name):
    case = Case(
        name="test/twins", scene=scene_of(SCENES[name]), stresses="Twins.", covers=("HIT-9",), least_interior=1,
        most_explained=0.9,
    )  # fmt: skip
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    twins = truth[Stage.OBJECT][..., 0] == 0
    objects = truth[Stage.OBJECT].copy()
    objects[twins, 1] = np.arange(twins.sum()) % 2
    stages = list(Stage)[list(Stage).index(Stage.DISTANCE) :]

    def judged(objects: np.ndarray) -> Outcome:
        ours = dict(truth) | {Stage.OBJECT: objects}
        for stage in stages:
            ours[stage] = ORACLE.continue_from(case.scene, stage, ours)
        return judge_case(case, [candidate(rounded(ours))], [witness(truth)], ORACLE, {}).outcome

    assert twins.sum() > 15
    assert judged(objects) is Outcome.PASS
    row, column = np.argwhere(twins)[twins.sum() // 2]
    objects[row, column, 0] = 1
    objects[row, column, 1] = 0
    assert judged(objects) is Outcome.FAIL
