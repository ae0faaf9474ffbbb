"""The ladders are data: complete, drawn by seed, and made of numbers that the precision has."""

import numpy as np
import pytest

from rayproof.cases.ladders import Gate, Ladder, all_ladders, rounded

LADDERS = all_ladders()


@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: ladder.name)
def test_a_ladder_says_what_it_predicts(ladder: Ladder) -> None:
    assert ladder.parameter
    assert ladder.unit
    assert ladder.condition
    assert ladder.first_to_break
    assert ladder.survivor
    assert set(ladder.gate.reaches) == {"float32", "float64"}


@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: ladder.name)
def test_inputs_are_seeded_numbers_of_the_precision(ladder: Ladder, precision: str) -> None:
    value = ladder.values[len(ladder.values) // 2]

    first, again = (ladder.draw(value, 8, np.random.default_rng(ladder.seed), precision) for _ in "ab")

    for name, array in first.items():
        np.testing.assert_array_equal(array, again[name])
        if name != "fovy":  # Python's own number, degrees, in every precision
            np.testing.assert_array_equal(array, rounded(array, precision))


def test_a_gate_that_is_no_value_of_the_sweep_is_refused() -> None:
    some = LADDERS[0]

    with pytest.raises(ValueError, match=r"which is none of"):
        Ladder(
            **{name: getattr(some, name) for name in some.__dataclass_fields__ if name != "gate"},
            gate=Gate(reaches={"float32": -1.0}),
        )
