"""The judge of relations: what it must not pass, and what it must excuse."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.laws.relations import Conditions, Relation
from rayproof.cases.stages import Stage
from rayproof.reports.judge.laws import judge

SCENE = select(["primitives/sphere"])[0].scene
ROWS, COLUMNS = np.mgrid[0:21, 0:31]
SMOOTH = np.stack([1 + 0.02 * COLUMNS + 0.01 * ROWS, 2 - 0.01 * COLUMNS, 1 + 0.001 * COLUMNS * ROWS], axis=-1)
HALVES = np.where((COLUMNS < 15)[..., np.newaxis], SMOOTH, 0.2 * SMOOTH)


def relation(expected: np.ndarray, measured: np.ndarray, **more: object) -> Relation:
    """Return a relation of two images of radiance."""
    facts = {"stage": Stage.RADIANCE, "scene": SCENE, "changed": SCENE, "what": "a test"} | more
    return Relation(expected=expected, measured=measured, **facts)  # pyright: ignore[reportArgumentType]


def test_rounding_is_allowed() -> None:
    judged = judge(relation(SMOOTH, SMOOTH * (1 + 2.0**-23)), "float32")

    assert not judged.alarm
    assert 0 < judged.worst < 1


def test_what_float32_may_do_float64_may_not() -> None:
    assert judge(relation(SMOOTH, SMOOTH * (1 + 2.0**-23)), "float64").alarm


@pytest.mark.parametrize("value", [1e-3, np.nan, np.inf])
def test_one_wrong_pixel_is_an_alarm_that_names_it(value: float) -> None:
    wrong = SMOOTH.copy()
    wrong[7, 11] += value

    judged = judge(relation(SMOOTH, wrong), "float32")

    assert judged.alarm
    assert judged.pixel == (11, 7)
    assert judged.outside == 1


def test_an_image_shifted_by_a_pixel_is_an_alarm_although_each_value_is_a_neighbours() -> None:
    assert judge(relation(SMOOTH, np.roll(SMOOTH, 1, axis=1)), "float32").alarm


def test_an_edge_that_moved_over_a_pixel_is_excused_and_counted() -> None:
    moved = HALVES.copy()
    moved[4, 15] = SMOOTH[4, 15]

    judged = judge(relation(HALVES, moved), "float32")

    assert not judged.alarm
    assert judged.excused == 1


def test_a_value_of_neither_side_is_not_excused() -> None:
    moved = HALVES.copy()
    moved[4, 15] = 3 * SMOOTH[4, 15]

    assert judge(relation(HALVES, moved), "float32").alarm


def test_an_edge_that_moved_everywhere_is_an_alarm() -> None:
    moved = np.where((COLUMNS < 16)[..., np.newaxis], SMOOTH, 0.2 * SMOOTH)

    judged = judge(relation(HALVES, moved), "float32")

    assert judged.excused + judged.outside == 21
    assert judged.alarm


def test_pixels_that_a_law_does_not_speak_of_are_not_examined() -> None:
    wrong = SMOOTH.copy()
    wrong[7, 11] += 1
    spoken = np.ones(ROWS.shape, dtype=bool)
    spoken[7, 11] = False

    judged = judge(relation(SMOOTH, wrong, examined=spoken), "float32")

    assert not judged.alarm
    assert judged.examined == SMOOTH.shape[0] * SMOOTH.shape[1] - 1


def test_an_exact_law_allows_no_bit() -> None:
    exact = Conditions(exact=True)

    assert not judge(relation(SMOOTH, SMOOTH.copy(), conditions=exact), "float32").alarm
    assert judge(relation(SMOOTH, SMOOTH * (1 + 2.0**-40), conditions=exact), "float32").alarm


def test_a_law_whose_limit_tells_nothing_says_so_and_does_not_pass() -> None:
    judged = judge(relation(SMOOTH, 9 * SMOOTH, conditions=Conditions(factor=1e5)), "float32")

    assert judged.ill_conditioned
    assert judged.examined == 0
    assert not judged.alarm


def test_another_size_is_an_alarm() -> None:
    assert judge(relation(SMOOTH, SMOOTH[1:]), "float32").alarm


def test_a_miss_where_the_law_expects_a_hit_is_an_alarm() -> None:
    expected = 5 + SMOOTH[..., :1]
    measured = expected.copy()
    measured[9, 9] = np.inf

    assert judge(relation(expected, measured, stage=Stage.DISTANCE), "float32").alarm
    assert not judge(relation(measured, measured.copy(), stage=Stage.DISTANCE), "float32").alarm
