"""Small scenes and parties that the judge's tests share."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.scene import Camera, Plane, PointLight, Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
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


@lru_cache(maxsize=16)
def truth_of_scene(scene: Scene, oracle: Analytic = ORACLE) -> SceneTruth:
    """Return the oracle's answers to a scene, not to be spoilt, and their conditioning."""
    return scene_truth(scene, stages_of(scene), oracle)


def against(scene: Scene, answers: dict, *, oracle: Analytic = ORACLE, **more) -> AgainstOracle:
    """Return what is said of a float32 renderer without epsilons, but for those in `more`, against the oracle."""
    renderer = replace(candidate(answers), **({"shadow_epsilon": 0.0} | more))
    return AgainstOracle(truth_of_scene(scene, oracle), renderer)


def kinds(scene: Scene, answers: dict, pixel: tuple[int, int], **more) -> dict[Stage, Kind]:
    """Return the kind of one pixel (row, column) in each image stage that the renderer answers."""
    return {stage: Kind(int(one.kinds[pixel])) for stage, one in against(scene, answers, **more).end_to_end.items()}


def kind(scene: Scene, answers: dict, stage: Stage, pixel: tuple[int, int], **more) -> Kind:
    """Return the kind of one pixel (row, column) of a stage."""
    return kinds(scene, answers, pixel, **more)[stage]


def followed(scene: Scene, answers: dict, stage: Stage, image: np.ndarray, *, oracle: Analytic = ORACLE) -> dict:
    """Return a float32 renderer's answers that has `image` at one stage, and what follows from it."""
    ours = dict(answers) | {stage: image}
    stages = stages_of(scene)
    for later in stages[stages.index(stage) + 1 :]:
        ours[later] = oracle.continue_from(scene, later, ours)
    return rounded(ours)


def naming(scene: Scene, pixel: tuple[int, int], shape: float, face: float = 0.0) -> dict:
    """Return a float32 renderer's answers that sees another object in one pixel, and what follows from it."""
    answers = truth_of_scene(scene).truth
    return followed(scene, answers, Stage.OBJECT, put(answers[Stage.OBJECT], pixel, (shape, face)))


def seen_around(scene: Scene, pixel: tuple[int, int], reach: float = 1e-8) -> Iterator[dict]:
    """Yield float32 renderers' answers that see in one pixel what is seen `reach` [px] beside it, each object once."""
    turns = np.linspace(0.0, 2 * np.pi, 48, endpoint=False) + 0.01
    points = np.array(pixel[::-1]) + 0.5 + reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    truth = truth_of_scene(scene).truth
    stages = [stage for stage in truth if stage is not Stage.CAMERA]
    seen = ORACLE.at(scene, stages, points)
    for place in np.unique(seen[Stage.OBJECT], axis=0, return_index=True)[1]:
        yield rounded(dict(truth) | {stage: put(truth[stage], pixel, seen[stage][place]) for stage in stages})


def put(image: np.ndarray, pixel: tuple[int, int], value) -> np.ndarray:
    """Return an image with another value in one pixel (row, column)."""
    changed = np.array(image)
    changed[pixel] = value
    return changed
