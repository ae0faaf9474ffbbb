"""Small scenes and parties that the judge's tests share."""

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.scene import Camera, Plane, PointLight, Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged

CAMERA = Camera(
    eye=(3.0, -4.0, 2.5), target=(0.1, 0.2, 0.3), up=(0.1, 0.2, 1.0), fovy=40.0, width=40, height=30, near=0.1, far=50.0
)
BALL = Sphere(albedo=(0.7, 0.5, 0.3), center=(0.2, 0.1, 0.4), radius=0.9)
FLOOR = Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0.3), (0, 1, 0, 0.1), (0, 0, 1, -0.7), (0, 0, 0, 1)))
LIGHT = PointLight(position=(1.5, -1.0, 4.0), flux=(100.0, 80.0, 60.0))
SCENE = Scene(camera=CAMERA, shapes=(BALL, FLOOR), lights=(LIGHT,))
CASE = Case(
    name="test/ball",
    scene=SCENE,
    stresses="A ball on a floor.",
    covers=("CAM-4", "HIT-1", "HIT-4", "RAD-2"),
    least_interior=500,
    most_explained=0.05,
)
ITEMS = ITEMS_OF_OTHERS
ORACLE = Analytic()


def truth() -> dict:
    """Return the oracle's answers, fresh arrays that a test may spoil."""
    return ORACLE.render(SCENE, stages_of(SCENE))


def rounded(answers: dict) -> dict:
    """Return answers as a faultless float32 renderer would give them."""
    spoilt = dict(answers)
    for stage, image in answers.items():
        if stage is not Stage.CAMERA:
            spoilt[stage] = np.asarray(image).astype(np.float32).astype(np.float64)
    return spoilt


def candidate(answers: dict, *, name: str = "float32", error: str | None = None) -> Answers:
    """Return a float32 candidate with these answers."""
    return Answers(
        name=name,
        precision="float32",
        items=ITEMS,
        shadow_epsilon=1e-6,
        answers={} if error else answers,
        error=error,
    )


def witness(answers: dict, *, name: str = "analytic", precision: str = "float64", **more) -> Answers:
    """Return a witness with these answers."""
    return Answers(name=name, precision=precision, independent=True, answers=answers, **more)


def verdict(ours: dict, *others: Answers, case: Case = CASE) -> Judged:
    """Judge answers against the oracle and others."""
    return judge_case(case, [candidate(ours)], [witness(truth()), *others], ORACLE, {})
