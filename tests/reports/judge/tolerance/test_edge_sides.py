"""What a pixel at an edge may be: one side's value, to within that side's own limit."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Scene, Sphere, Square
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.comparison import Comparison
from rayproof.reports.judge.edge_sides import Sides, sides, with_ends
from rayproof.reports.judge.edge_values import excused
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.reports.judge.sentinels import BORDER, EDGE_CASE, SIDE
from rayproof.reports.judge.stage_measuring import measure_end_to_end
from tests.reports.judge.scenes import ORACLE, candidate, rounded, witness


def test_a_sides_value_is_held_to_its_own_limit_and_not_to_a_blunter_neighbours() -> None:
    objects = np.array([[0.0, 0.0, 1.0, 2.0]])
    limits = np.array([[1e-6, 1e-6, 1e-5, 1e-1]])
    both = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    around = Sides(
        rows=np.array([0]),
        columns=np.array([1]),
        answers={Stage.OBJECT: both, Stage.NORMAL: np.array([[[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]])},
    )

    def good(shape: int, factor: float) -> bool:
        normal = factor * np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])[shape]
        ours = {
            Stage.OBJECT: np.broadcast_to([float(shape), 0.0], (1, 4, 2)),
            Stage.NORMAL: np.broadcast_to(normal, (1, 4, 3)),
        }
        return bool(excused(Stage.NORMAL, ours, around, limits, objects, continued=False)[0, 1])

    assert [good(shape, 1.0) for shape in (0, 1)] == [True, True]
    assert [good(shape, 1.001) for shape in (0, 1)] == [False, False]
    # Two pixels away the other side is known less well.
    assert [good(shape, 1 + 4e-6) for shape in (0, 1)] == [False, True]


def test_towards_a_horizon_a_distance_may_be_any_larger_one_and_not_nothing() -> None:
    around = Sides(
        rows=np.array([0]),
        columns=np.array([0]),
        answers={
            Stage.OBJECT: np.array([[[0.0, 0.0], [0.0, 0.0], [-1.0, -1.0]]]),
            Stage.DISTANCE: np.array([[[60.0], [350.0], [np.inf]]]),
        },
        spare=1.0,
        endless=(0,),
    )

    def good(distance: float) -> bool:
        ours = {Stage.OBJECT: np.zeros((1, 1, 2)), Stage.DISTANCE: np.full((1, 1, 1), distance)}
        limits, objects = np.full((1, 1), 15.0), np.zeros((1, 1))
        return bool(excused(Stage.DISTANCE, ours, around, limits, objects, continued=False)[0, 0])

    assert [good(distance) for distance in (0.0, 15.0, 40.0, 60.0, 350.0, 2000.0)] == [
        False,
        False,
        True,
        True,
        True,
        True,
    ]


@pytest.mark.parametrize(("reach", "farthest"), [(0.01, 0.02), (7.0, 1.0)])
def test_no_side_is_looked_for_beyond_twice_the_reach_nor_beyond_a_neighbours_centre(
    reach: float, farthest: float
) -> None:
    class Watched:
        """An oracle that sees nothing, and keeps the points that it was asked about."""

        points: np.ndarray

        def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
            self.points = points
            return {Stage.OBJECT: np.full((len(points), 2), -1.0)}

        def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
            raise AssertionError

    oracle, size = Watched(), (EDGE_CASE.scene.camera.height, EDGE_CASE.scene.camera.width)
    where = np.zeros(size, dtype=bool)
    where[BORDER] = True

    sides(oracle, EDGE_CASE.scene, (Stage.OBJECT,), where, np.full(size, reach))

    row, column = BORDER
    apart = np.linalg.norm(oracle.points - (column + 0.5, row + 0.5), axis=1)
    assert apart.max() == pytest.approx(farthest)
    assert len(apart) > 20


def test_where_what_is_seen_ends_is_found_along_each_direction() -> None:
    scene = replace(EDGE_CASE.scene, shapes=(Sphere(albedo=(0.5, 0.5, 0.5)),))
    truth = ORACLE.render(scene, (Stage.OBJECT, Stage.DISTANCE))
    where = np.zeros(truth[Stage.OBJECT].shape[:2], dtype=bool)
    row = where.shape[0] // 2
    column = int(np.argmax(truth[Stage.OBJECT][row, :, 0] == 0))
    where[row, column] = True
    plain = sides(ORACLE, scene, (Stage.OBJECT, Stage.DISTANCE), where, np.full(where.shape, 0.5))

    ended = with_ends(plain, ORACLE, scene, where, np.full(where.shape, 0.5))

    # The outline of a sphere is as far away as the tangent from the eye is long.
    tangent = np.sqrt(np.linalg.norm(scene.camera.eye) ** 2 - 1)
    farthest = [
        np.where(around.answers[Stage.OBJECT][..., :1] == 0, around.answers[Stage.DISTANCE], 0.0).max()
        for around in (plain, ended)
    ]
    assert farthest[0] < tangent - 1e-2
    assert farthest[1] == pytest.approx(tangent, abs=1e-2)


def level(side: float, height: float) -> Square:
    """Return a level square around the z axis."""
    matrix = ((side, 0.0, 0.0, 0.0), (0.0, side, 0.0, 0.0), (0.0, 0.0, 1.0, height), (0.0, 0.0, 0.0, 1.0))
    return Square(albedo=(0.5, 0.5, 0.5), to_world=matrix)


def layered(gap: float) -> Comparison:
    """Return the terms of three squares seen from above, the second 1 m below the first, the third `gap` [m] below it.

    The border of the first one meets pixel centres, and the others fill the frame.
    """
    shapes = (level(SIDE, 0.0), level(3.0, -1.0), level(3.0, -1.0 - gap))
    scene = replace(EDGE_CASE.scene, shapes=shapes)
    truth = ORACLE.render(scene, stages_of(scene))
    base = scene_truth(scene, stages_of(scene), ORACLE, known=truth)
    return Comparison(base=base, subject=candidate(rounded(truth)), reference=witness(truth))


@pytest.mark.parametrize(("depths", "kind"), [(0.3, Kind.SIDE), (5.0, Kind.WRONG)])
def test_a_surface_that_lies_deeper_than_rounding_cannot_tell_apart_is_no_side(depths: float, kind: Kind) -> None:
    """At the border of the upper square its neighbour is the middle one, and never the lowest one right below that."""
    pair = layered(depths * float(layered(0.5).classes.depth[BORDER]))
    answers = dict(pair.subject.answers)
    answers[Stage.OBJECT] = answers[Stage.OBJECT].copy()
    answers[Stage.OBJECT][BORDER] = (2.0, 0.0)
    spoilt = replace(pair.subject, name="spoilt", answers=answers)

    found = measure_end_to_end(Comparison(base=pair.base, subject=spoilt, reference=pair.reference), Stage.OBJECT)

    assert found.kinds[BORDER] == kind


def test_where_two_surfaces_coincide_light_is_known_as_well_as_how_deep_they_lie() -> None:
    """Light goes as cos / r^2: a surface that may lie a depth farther away takes three times that share of r."""
    pixel = (1, 1)
    pair = layered(0.3 * float(layered(0.5).classes.depth[pixel]))
    (light,) = pair.scene.lights
    r = float(np.linalg.norm(np.asarray(light.position) - pair.truth[Stage.POSITION][pixel]))
    share = 3 * float(pair.classes.depth[pixel]) / r

    def kind(shares: float) -> Kind:
        answers = dict(pair.subject.answers)
        answers[Stage.IRRADIANCE] = answers[Stage.IRRADIANCE].copy()
        answers[Stage.IRRADIANCE][pixel] *= 1 + shares * share
        spoilt = replace(pair.subject, name=f"spoilt by {shares}", answers=answers)
        spoilt_pair = Comparison(base=pair.base, subject=spoilt, reference=pair.reference)
        return Kind(measure_end_to_end(spoilt_pair, Stage.IRRADIANCE).kinds[pixel])

    assert pair.twins[pixel]
    assert kind(0.5) != Kind.WRONG
    assert kind(30.0) == Kind.WRONG


@pytest.mark.parametrize(("epsilon", "kind"), [(0.01, Kind.EPSILON), (0.0, Kind.WRONG)])
def test_surfaces_nearer_to_each_other_than_a_reference_declares_are_one_to_it(epsilon: float, kind: Kind) -> None:
    """Two hits whose distances differ by less than 1e-6 of its units are a tie to rtrace, which names either."""
    pair, pixel = layered(0.005), (1, 1)
    answers = dict(pair.reference.answers)
    answers[Stage.OBJECT] = np.where(answers[Stage.OBJECT] == (1.0, 0.0), (2.0, 0.0), answers[Stage.OBJECT])
    second = replace(pair.reference, name="second", answers=answers, tie_epsilon=epsilon)

    found = measure_end_to_end(Comparison(base=pair.base, subject=second, reference=pair.reference), Stage.OBJECT)

    assert pair.truth[Stage.OBJECT][pixel][0] == 1
    assert found.kinds[pixel] == kind
