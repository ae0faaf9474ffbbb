"""Where the scene itself leaves an answer to rounding, either answer is right and a third one is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import CASE_FAMILIES, select
from rayproof.cases.random_scenes import random_case
from rayproof.cases.scene import Camera, PointLight, Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Freedom
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import ORACLE, candidate, rounded, witness


def case_named(name: str) -> Case:
    """Return a case of the suite."""
    return next(case for case in CASE_FAMILIES[name.split("/")[0]]() if case.name == name)


TWINS, LAMP = case_named("nearest/coincident"), case_named("acne/light_on_a_blocker")


def truth_of(case: Case) -> dict:
    """Return the oracle's answers."""
    return ORACLE.render(case.scene, stages_of(case.scene))


def judged(case: Case, ours: dict, truth: dict) -> Judged:
    """Judge a float32 candidate before the oracle."""
    return judge_case(case, [candidate(ours)], [witness(truth)], ORACLE, {})


def answered(case: Case, truth: dict, stage: Stage, image: np.ndarray) -> dict:
    """Return a float32 renderer's answers that has `image` at one stage, and what follows from it."""
    ours = dict(truth) | {stage: image}
    stages = list(Stage)
    for later in stages[stages.index(stage) + 1 :]:
        ours[later] = ORACLE.continue_from(case.scene, later, ours)
    return rounded(ours)


def overlap(truth: dict) -> np.ndarray:
    """Return the pixels (height, width) that see both squares at once."""
    rays = truth[Stage.RAY].reshape(-1, 3)
    first, second = (ORACLE.distances(TWINS.scene, rays, np.tile((shape, 0.0), (len(rays), 1))) for shape in (0.0, 1.0))
    with np.errstate(invalid="ignore"):
        both = np.abs(first - second) < 1e-9
    return (truth[Stage.OBJECT][..., 0] == 0) & both.reshape(truth[Stage.OBJECT].shape[:2])


def by_the_lights_place(case: Case, way: float) -> np.ndarray:
    """Return the pixels (height, width) that see the light or not by which side of its place it is moved to."""
    seen = []
    for sign in (-1.0, 1.0):
        lights = tuple(
            replace(light, position=(*light.position[:2], light.position[2] + sign * way))
            for light in case.scene.lights
        )
        seen.append(ORACLE.render(replace(case.scene, lights=lights), [Stage.VISIBILITY])[Stage.VISIBILITY])
    return (seen[0] != seen[1]).any(axis=-1)


def test_of_coincident_squares_either_may_be_answered():
    truth = truth_of(TWINS)
    both = overlap(truth)
    objects = truth[Stage.OBJECT].copy()
    objects[both & (np.indices(both.shape).sum(axis=0) % 2 == 0), 0] = 1

    result = judged(TWINS, answered(TWINS, truth, Stage.OBJECT, objects), truth)

    assert both.sum() > 200
    assert result.outcome is Outcome.PASS, result.reason


@pytest.mark.parametrize("wrong", [2.0, -1.0], ids=["the-ball", "a-miss"])
def test_of_coincident_squares_nothing_else_may_be_answered(wrong):
    truth = truth_of(TWINS)
    ours = rounded(truth)
    row, column = np.argwhere(overlap(truth))[100]
    ours[Stage.OBJECT][row, column, 0] = wrong

    result = judged(TWINS, ours, truth)

    assert (result.outcome, result.stage) == (Outcome.FAIL, Stage.OBJECT)


@pytest.mark.parametrize("pixel", [(17, 10), (20, 14)], ids=str)
def test_a_face_that_occurs_twice_excuses_no_place_but_its_own(pixel):
    """Seen at grazing incidence, where a pixel's neighbourhood reaches a millimetre and its limit less."""
    case, (column, row) = random_case(90417, 369), pixel
    truth = truth_of(case)
    ours = rounded(truth)
    ours[Stage.POSITION][row, column] *= 1.001
    alone = replace(candidate(ours), chained=False)  # of which continued limits tell less

    result = judge_case(case, [alone], [witness(truth)], ORACLE, {})

    assert (result.outcome, result.stage) == (Outcome.FAIL, Stage.POSITION)


@pytest.mark.parametrize(
    ("pixel", "distance", "outcome"),
    [((16, 12), 0.16429148149321593, Outcome.PASS), ((16, 13), 0.164, Outcome.FAIL)],
    ids=["on-it", "another-ray"],
)
def test_a_square_that_holds_the_eye_is_met_anywhere_along_a_ray_within_it(pixel, distance, outcome):
    """The middle ray of this scene runs within the square: the oracle misses it, and certified arithmetic hits it."""
    case, (column, row) = random_case(51205, 196), pixel
    truth = truth_of(case)
    objects, distances = truth[Stage.OBJECT].copy(), truth[Stage.DISTANCE].copy()
    objects[row, column], distances[row, column] = 0.0, distance

    result = judged(case, answered(case, truth | {Stage.OBJECT: objects}, Stage.DISTANCE, distances), truth)

    assert result.outcome is outcome, result.reason


def test_a_plane_that_holds_the_eye_has_one_normal():
    # 1 mm large and 400 m from the origin: rounding would turn a face made of such corners by a radian.
    case = random_case(72002, 19)
    truth = truth_of(case)
    longer = truth[Stage.NORMAL].copy()
    longer[0, 15] *= 1.001

    result = judged(case, answered(case, truth, Stage.NORMAL, longer), truth)

    check = next(check for check in result.checks if check.stage is Stage.NORMAL)
    assert check.end_to_end is not None
    assert np.argwhere(check.end_to_end.kinds == Kind.WRONG).tolist() == [[0, 15]]


def test_a_light_on_a_blocker_may_be_blocked_or_not():
    truth = truth_of(LAMP)
    pixels = by_the_lights_place(LAMP, 1e-9)
    visible = truth[Stage.VISIBILITY].copy()
    visible[pixels, 0] = np.arange(pixels.sum()) % 2

    result = judged(LAMP, answered(LAMP, truth, Stage.VISIBILITY, visible), truth)

    assert pixels.sum() > 200
    assert result.outcome is Outcome.PASS, result.reason


def test_a_light_on_a_blocker_excuses_nothing_below_its_horizon():
    truth = truth_of(LAMP)
    row, column = np.argwhere((truth[Stage.OBJECT][..., 0] == 0) & ~by_the_lights_place(LAMP, 1e-3))[-1]
    visible = truth[Stage.VISIBILITY].copy()
    visible[row, column, 0] = 1

    result = judged(LAMP, answered(LAMP, truth, Stage.VISIBILITY, visible), truth)

    assert (result.outcome, result.stage) == (Outcome.FAIL, Stage.VISIBILITY)


@pytest.mark.parametrize(("epsilon", "outcome"), [(0.05, Outcome.PASS), (1e-5, Outcome.REFERENCE_SUSPECT)], ids=str)
def test_who_does_not_see_the_end_of_a_shadow_ray_is_excused_as_far_as_that_and_no_farther(epsilon, outcome):
    light = LAMP.scene.lights[0]
    x, y, z = light.position
    case = replace(
        LAMP, scene=replace(LAMP.scene, lights=(replace(light, position=(x, y, z + 1e-3)),)), most_explained=0.99
    )
    truth = truth_of(case)
    rows = {stage: image.reshape(-1, image.shape[-1]) for stage, image in truth.items() if stage is not Stage.CAMERA}
    visible = ORACLE.visibility(case.scene, rows, Freedom(light=0.04)).reshape(truth[Stage.VISIBILITY].shape)
    pixels = (visible != truth[Stage.VISIBILITY]).any(axis=-1)
    blind = replace(
        witness(answered(case, truth, Stage.VISIBILITY, visible), name="second", precision="float32"),
        light_epsilon=epsilon,
    )

    result = judge_case(
        replace(case, least_interior=0), [candidate(rounded(truth))], [witness(truth), blind], ORACLE, {}
    )

    assert pixels.sum() > 200
    found = {check.outcome for check in result.checks if (check.reference, check.stage) == ("second", Stage.VISIBILITY)}
    assert found == {outcome}


@pytest.mark.parametrize(("epsilon", "outcome"), [(0.03, Outcome.PASS), (1e-6, Outcome.REFERENCE_SUSPECT)], ids=str)
def test_outlines_reach_as_far_as_a_reference_declares_and_the_pixels_are_counted(epsilon, outcome):
    truth = truth_of(TWINS)
    objects = truth[Stage.OBJECT].copy()
    before = np.roll(objects, 1, axis=1)
    rows, columns = np.nonzero(before[..., 0] != objects[..., 0])
    beside = [
        ORACLE.at(TWINS.scene, [Stage.OBJECT], np.stack([columns + 0.5 - way, rows + 0.5], axis=1))[Stage.OBJECT]
        for way in (1e-3, 0.3)
    ]
    here, there = objects[rows, columns], before[rows, columns]
    place = np.flatnonzero((beside[0] == here).all(axis=1) & (beside[1] == there).all(axis=1))[0]
    row, column = rows[place], columns[place]
    objects[row, column] = before[row, column]
    other = replace(
        witness(answered(TWINS, truth, Stage.OBJECT, objects), name="second", precision="float32"), edge_epsilon=epsilon
    )
    case = replace(TWINS, least_interior=0, most_explained=0.99)

    result = judge_case(case, [candidate(rounded(truth))], [witness(truth), other], ORACLE, {})

    check = next(one for one in result.checks if (one.reference, one.stage) == ("second", Stage.OBJECT))
    assert check.outcome is outcome
    assert check.end_to_end is not None
    assert np.any(check.end_to_end.kinds == Kind.EPSILON) == (outcome is Outcome.PASS)


@pytest.mark.parametrize("way", [-1, 1])
@pytest.mark.parametrize("name", ["random/1/298", "random/31102/1"])
def test_without_clipping_a_surface_that_holds_the_eye_is_seen_from_either_side_or_not(name, way):
    (case,) = select([name])
    view = case.scene.camera
    step = way * 1e-8 * np.subtract(view.target, view.eye)
    eye, target = (tuple((np.asarray(point) + step).tolist()) for point in (view.eye, view.target))
    moved = replace(case.scene, camera=replace(view, eye=eye, target=target))

    result = judged(case, rounded(ORACLE.render(moved, stages_of(moved))), truth_of(case))

    assert result.outcome in (Outcome.PASS, Outcome.UNDECIDED), result.reason


def wall_at(end: str, moved: float) -> Case:
    """Return a case of a wall that faces the camera, so much (relative) behind an end of clipping, before another."""
    depth = 3.7 * (1 + moved)
    ends = {"near": 0.1, "far": 50.0} | {end: 3.7}
    camera = Camera(eye=(0.3, 0.1, depth), target=(0.3, 0.1, 0.0), up=(0, 1, 0), fovy=40.0, width=24, height=16, **ends)
    wall = Square(albedo=(0.5, 0.4, 0.3), to_world=((1, 0, 0, -1.1), (0, 1, 0, 0.2), (0, 0, 1, 0), (0, 0, 0, 1)))
    before = replace(wall, to_world=((0.5, 0, 0, 0.7), (0, 0.5, 0, 0.1), (0, 0, 1, 0.2), (0, 0, 0, 1)))
    behind = replace(wall, to_world=((40, 0, 0, 0.3), (0, 40, 0, 0.1), (0, 0, 1, -3.0), (0, 0, 0, 1)))
    light = PointLight(position=(1.5, -1.0, 4.0), flux=(100.0, 80.0, 60.0))
    scene = Scene(camera=camera, shapes=(wall, before, behind), lights=(light,))
    return Case(
        name="test/ball",
        scene=scene,
        stresses="A wall at an end.",
        covers=("CAM-4",),
        least_interior=5,
        most_explained=0.9,
    )


@pytest.mark.parametrize("end", ["near", "far"])
@pytest.mark.parametrize("moved", [2.0**-36, 0.0, -(2.0**-36)])
def test_a_wall_within_rounding_of_an_end_of_clipping_may_be_seen_or_not(end, moved):
    case, seen, hidden = (wall_at(end, each) for each in (moved, 1e-12, -1e-12))
    odd = (np.indices((16, 24)).sum(axis=0) % 2 == 0)[..., np.newaxis]
    truth, one, other = truth_of(case), truth_of(seen), truth_of(hidden)
    mixed = truth | {stage: np.where(odd, one[stage], other[stage]) for stage in one if stage is not Stage.CAMERA}

    assert judged(case, rounded(mixed), truth).outcome is Outcome.PASS
    spoilt = dict(mixed)
    spoilt[Stage.DISTANCE] = np.where(np.isfinite(mixed[Stage.DISTANCE]), 1.001, 1.0) * mixed[Stage.DISTANCE]
    assert judged(case, rounded(spoilt), truth).outcome is not Outcome.PASS


@pytest.mark.parametrize(("along", "outcome"), [(0.0, Outcome.PASS), (0.2, Outcome.FAIL)])
def test_what_a_surface_hides_by_rounding_alone_is_seen_as_far_as_rounding_moves_its_outline(along, outcome):
    # A triangle in a plane, 6 km from the origin; pixels span 19 mm, and its corners lie 0.02 mm below the plane.
    (case,) = select(["random/61302/13"])
    truth, plane, triangle = truth_of(case), *case.scene.shapes
    matrix = np.array(triangle.to_world)
    matrix[:3, 3] += (-0.392 * along, 0.92 * along, 1e-3)
    raised = replace(triangle, to_world=tuple(map(tuple, matrix.tolist())))
    ours = ORACLE.render(replace(case.scene, shapes=(plane, raised)), stages_of(case.scene))
    assert np.flatnonzero(ours[Stage.OBJECT][..., 0])[-1] == (107 if along == 0 else 111)

    result = judged(replace(case, most_explained=0.9), rounded(ours), truth)

    assert result.outcome is outcome, result.reason
