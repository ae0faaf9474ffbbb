"""Truth agrees with closed forms, settles ties, and is confirmed by balls."""

from typing import Any

import numpy as np
import pytest

from rayproof.reference.certified.columns import decided, evaluated, witnessed
from rayproof.reference.certified.meetings import SHAPES, ExactHit, towards


def hit(shape: str, **inputs: Any) -> ExactHit:
    """Return the exact answer to one ray."""
    given = {name: np.array([value], dtype=np.float64) for name, value in inputs.items()}
    if shape == "cube":
        given["towards"] = towards(given["d"])
    mathematics = SHAPES[shape]()
    return mathematics.decide(decided(mathematics.predicates, given), evaluated(mathematics.values, given), given)


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        pytest.param(5.0, 4.0, id="from-in-front"),
        pytest.param(0.0, 1.0, id="from-the-centre"),
        pytest.param(1.0, 2.0, id="from-the-surface-inwards"),
        pytest.param(-1.0, None, id="from-the-surface-outwards"),
        pytest.param(-5.0, None, id="from-behind"),
    ],
)
def test_a_unit_sphere_along_its_axis(start: float, expected: float | None) -> None:
    found = hit("sphere", o=[0, 0, start], d=[0, 0, -1], c=[0, 0, 0], r=1.0)

    assert bool(found.hit[0]) is (expected is not None)
    if expected is not None:
        assert found.t.high[0] == expected


def test_a_tangent_ray_hits_and_one_float_farther_does_not() -> None:
    touching = {"o": [1.0, 0, 5], "d": [0, 0, -1], "c": [0, 0, 0]}

    found = hit("sphere", r=1.0, **touching)
    assert (found.hit[0], found.t.high[0]) == (True, 5.0)
    assert not hit("sphere", r=float(np.nextafter(1.0, 0)), **touching).hit[0]


@pytest.mark.parametrize(
    ("origin", "direction", "expected"),
    [
        pytest.param([0, 0, 5], [0, 0, -1], 4.5, id="face"),
        pytest.param([0.5, -2, 0], [0.0, 1, 0], 1.5, id="in-a-face"),
        pytest.param([0.5, -2, 0], [-0.0, 1, 0], 1.5, id="in-a-face-minus-zero"),
        pytest.param([0.5, 0.5, 2], [0, 0, -1], 1.5, id="along-an-edge"),
        pytest.param([np.nextafter(0.5, 1), 0, 5], [0, 0, -1], None, id="a-float-beside"),
        pytest.param([0, 0, 0], [0, 0, -1], 0.5, id="from-inside"),
        pytest.param([0, 0, 5], [0, 0, 1], None, id="behind"),
    ],
)
def test_the_closed_cube(origin: list[float], direction: list[float], expected: float | None) -> None:
    found = hit("cube", o=origin, d=direction)

    assert bool(found.hit[0]) is (expected is not None)
    if expected is not None:
        assert found.t.high[0] == expected


def test_a_triangle_keeps_its_border_and_a_square_does_not() -> None:
    corners = {"a": [0, 0, 0], "b": [1, 0, 0], "c": [0, 1, 0]}

    assert hit("triangle", o=[0.5, 0, 1], d=[0, 0, -1], **corners).hit[0]
    assert not hit("triangle", o=[0.5, -1e-300, 1], d=[0, 0, -1], **corners).hit[0]
    assert not hit("square", o=[0.5, 0, 1], d=[0, 0, -1]).hit[0]
    assert hit("square", o=[float(np.nextafter(0.5, 0)), 0, 1], d=[0, 0, -1]).hit[0]


def test_a_witness_sees_a_truth_that_is_off() -> None:
    shape = SHAPES["sphere"]()
    generator = np.random.default_rng(2)
    inputs = {
        "o": generator.normal(size=(8, 3)) * 0.3,
        "d": generator.normal(size=(8, 3)),
        "c": np.zeros((8, 3)),
        "r": np.full(8, 2.0),
    }
    found = evaluated(shape.values, inputs)

    seen, worst = witnessed(shape.values, inputs, found, np.arange(8))
    found["far"].high = found["far"].high * (1 + 2.0**-40)
    _, off = witnessed(shape.values, inputs, found, np.arange(8))

    assert seen == 16
    assert worst < 2.0**-90
    assert off > 2.0**-41
