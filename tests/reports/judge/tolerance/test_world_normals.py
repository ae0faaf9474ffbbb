"""Normals of faces from float32 corners in world space are allowed what that rounding does, and no more."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.placement import camera_around, compose, rotation, translation, world_triangles
from rayproof.cases.scene import PointLight, Scene, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.forward.limits import BAKING
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.mistakes import MISTAKES
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import ORACLE, candidate, rounded, witness

MIDDLE = (61.3, -47.1, 83.7)  # m from the origin: a corner is off by up to 4 um there
LEAF = Triangle(
    albedo=(0.7, 0.5, 0.3),
    vertices=((-0.03, -0.02, 0.0), (0.03, -0.021, 0.001), (0.004, 0.031, -0.002)),
    to_world=compose(translation(*MIDDLE), rotation((0.3, 1.0, 0.2), 37.0)),
    two_sided=True,
)
LIGHT = PointLight(position=(161.3, -27.1, 113.7), flux=(3e6, 2e6, 4e6))  # so far off that its direction is exact
CAMERA = camera_around(MIDDLE, distance=0.2, azimuth=-20, elevation=65, width=40, height=30, near=0.01, far=9.0)
CASE = Case(
    name="test/leaf",
    scene=Scene(camera=CAMERA, shapes=(LEAF,), lights=(LIGHT,)),
    stresses="A small triangle far from the origin.",
    covers=("NRM-3",),
    least_interior=50,
    most_explained=0.9,
)
TRUTH = ORACLE.render(CASE.scene, stages_of(CASE.scene))


def answers(*, turned: float) -> dict:
    """Return the answers of a renderer whose normals are those of rounded corners, off by `turned` as much as they."""
    found = dict(TRUTH)
    right = TRUTH[Stage.NORMAL]
    corners = MISTAKES["normal_of_rounded_corners"]().render(CASE.scene, [Stage.NORMAL])[Stage.NORMAL]
    normal = right + turned * (corners - right)
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    found[Stage.NORMAL] = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)
    for stage in IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]:
        found[stage] = ORACLE.continue_from(CASE.scene, stage, found)
    return rounded(found)


def judged(given: dict, *, declared: bool, stages: tuple[Stage, ...]) -> Judged:
    """Judge these stages of a renderer that declares what it does, or does not."""
    unable = {stage: "It writes none." for stage in stages_of(CASE.scene) if stage not in stages}
    kept = {stage: given[stage] for stage in stages}
    program = replace(candidate(kept, name="exec"), chained=False, unsupported=unable, world_normals=declared)
    return of_what_is_supported(judge_case(CASE, [program], [witness(TRUTH)], ORACLE, {}), [program])


@pytest.mark.parametrize("stages", [IMAGE_STAGES, (Stage.RADIANCE,), (Stage.IRRADIANCE,)], ids=len)
def test_rounded_corners_pass_where_they_are_declared_and_only_there(stages: tuple[Stage, ...]) -> None:
    right = answers(turned=1)

    assert judged(right, declared=True, stages=stages).outcome is Outcome.PASS
    # By light alone corners that are off by a few roundings are within rounding, whoever has them: of all pixels.
    undeclared = judged(right, declared=False, stages=stages).outcome
    assert undeclared is (Outcome.FAIL if len(stages) > 1 else Outcome.UNDECIDED)


@pytest.mark.parametrize("stages", [IMAGE_STAGES, (Stage.RADIANCE,), (Stage.IRRADIANCE,)], ids=len)
def test_a_normal_that_is_off_by_more_than_corners_can_be_fails_though_they_are_declared(stages) -> None:
    wrong = answers(turned=40 if len(stages) > 1 else 400)

    found = judged(wrong, declared=True, stages=stages)

    assert found.outcome is Outcome.FAIL
    assert found.stage is (Stage.NORMAL if len(stages) > 1 else stages[0])


def test_corners_turn_a_triangle_by_no_more_than_is_derived_and_by_half_of_that() -> None:
    generator, most = np.random.default_rng(34), 0.0
    (corners,) = world_triangles(LEAF).astype(np.float64)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    edges = [np.linalg.norm(corners[a] - corners[b]) for a, b in ((0, 1), (1, 2), (2, 0))]
    height = np.linalg.norm(normal) / max(edges)
    for d in (1e-6 * height, height / 5):
        across = [sign * normal / np.linalg.norm(normal) for sign in (-1, 1)]
        moves = [np.array(each) for each in product(across, repeat=3)]
        moves += [each / np.linalg.norm(each, axis=-1, keepdims=True) for each in generator.normal(size=(500, 3, 3))]
        for move in moves:
            a, b, c = corners + d * move
            turned = np.cross(b - a, c - a)
            angle = np.arctan2(np.linalg.norm(np.cross(turned, normal)), turned @ normal)
            assert angle <= BAKING * d / height
            most = max(most, angle / (BAKING * d / height))
    assert most >= 0.45
