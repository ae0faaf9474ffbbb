"""What a pixel at an edge may be: one side's value, to within that side's own limit."""

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.judge.tolerance.edge_sides import Sides, excused


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
