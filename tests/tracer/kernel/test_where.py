"""A branch computes what its condition asks for, and leaves what others compute alone."""

import numpy as np

from rayproof.tracer.kernel.arrays import array_types, asked, where


def test_asking_computes_everything_everywhere() -> None:
    types = array_types("float32")

    with asked() as conditions:
        (found,) = where(types.Bool([True, False]), lambda: [types.Float([1, 2])], [types.Float(0)])

    assert [np.array(one).tolist() for one in conditions] == [[True, False]]
    assert np.array(found).tolist() == [1, 2]
    (chosen,) = where(types.Bool([True, False]), lambda: [types.Float([1, 2])], [types.Float(0)])
    assert np.array(chosen).tolist() == [1, 0]


def test_branches_leave_each_other_alone() -> None:
    types = array_types("float32")
    nothing, x = types.Bool(False), types.Float([1, 2])

    first = where(types.Bool([True, False]), lambda: [x > 1, x > 0], [nothing] * 2)
    second = where(types.Bool([False, True]), lambda: [x > 5, x > 1], [nothing] * 2)

    assert [np.array(one).tolist() for one in (*first, *second)] == [
        [False, False],
        [True, False],
        [False, False],
        [False, True],
    ]
