"""Bundles of pixels against exact rationals, and against the balls that they spare."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import fmpq

from rayproof.cases.scene import Plane, PointLight, Scene, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified import Certified, bundles
from rayproof.reference.certified.bundles import Bundle, Bundles, PartedError
from rayproof.reference.certified.fields import UndecidedError, precision
from tests.reference.analytic.scenes import looking_down, matrix, random_scene

ORACLE: Any = Certified()
GREY = (0.5, 0.25, 0.125)
COUNT = 200


def bundle(seed: int, *, radius: float = 0.0, wide: bool = True) -> Bundle:
    """Return random numbers of both signs, over many orders of magnitude if `wide`."""
    generator = np.random.default_rng(seed)
    high = generator.normal(size=COUNT) * (2.0 ** generator.integers(-60, 60, COUNT) if wide else 1.0)
    low = np.spacing(np.abs(high)) * generator.uniform(-0.5, 0.5, COUNT)
    return Bundle(high, low, np.abs(high) * radius)


def rationals(number: Bundle) -> list[Fraction]:
    """Return the middles, exactly."""
    return [Fraction(high) + Fraction(low) for high, low in zip(number.high.tolist(), number.low.tolist(), strict=True)]


def assert_encloses(found: Bundle, exact: list[Fraction], *, bits: int) -> None:
    """Assert that every exact value lies within the radius, and that the radius is small."""
    for middle, radius, value in zip(rationals(found), found.radius.tolist(), exact, strict=True):
        assert abs(middle - value) <= Fraction(radius)
        assert Fraction(radius) <= abs(value) / 2**bits + Fraction(1, 10**280)


@pytest.mark.parametrize("seed", range(3))
def test_products_and_quotients_enclose_the_exact_ones(seed: int) -> None:
    a, b = bundle(seed), bundle(seed + 100)
    pairs = list(zip(rationals(a), rationals(b), strict=True))

    assert_encloses(a * b, [x * y for x, y in pairs], bits=96)
    assert_encloses(a / b, [x / y for x, y in pairs], bits=96)
    assert_encloses(1 / a, [1 / x for x, _ in pairs], bits=96)
    assert_encloses(3 * a, [3 * x for x, _ in pairs], bits=96)
    assert (0 * a, a * 0) == (0, 0)


def test_sums_enclose_the_exact_ones_even_where_they_cancel() -> None:
    a, b = bundle(1, wide=False), bundle(2, wide=False)
    nearly = Bundle(-a.high, a.low, a.radius)
    exact = [x + y for x, y in zip(rationals(a), rationals(b), strict=True)]

    for found, value in zip(rationals(a + b), exact, strict=True):
        assert abs(found - value) <= Fraction(2) ** -98
    assert all(abs(x) <= Fraction(r) for x, r in zip(rationals(a - a), (a - a).radius.tolist(), strict=True))
    cancelled = [x + y for x, y in zip(rationals(a), rationals(nearly), strict=True)]
    radii = (a + nearly).radius.tolist()
    for found, value, radius in zip(rationals(a + nearly), cancelled, radii, strict=True):
        assert abs(found - value) <= Fraction(radius)


def test_roots_enclose_the_exact_ones() -> None:
    a = bundle(3)
    squares = a * a
    root = squares.sqrt()

    for found, value, radius in zip(rationals(root), rationals(a), root.radius.tolist(), strict=True):
        assert abs(found - abs(value)) <= Fraction(radius)
        assert radius <= abs(value) * 2.0**-95
    assert np.isinf(Bundle(np.array([1.0]), np.array([0.0]), np.array([0.9])).sqrt().radius).all()


def test_radii_of_operands_are_carried() -> None:
    """Whatever lies within the operands' radii, its product and quotient lie within theirs."""
    a, b = bundle(4, radius=1e-9), bundle(5, radius=1e-7)
    moved = [
        (x + Fraction(one) * sign, y - Fraction(other) * sign)
        for x, one, y, other in zip(rationals(a), a.radius.tolist(), rationals(b), b.radius.tolist(), strict=True)
        for sign in (-1, 1)
    ]

    product, quotient = a * b, a / b

    for index, (x, y) in enumerate(moved):
        row = index // 2
        assert abs(rationals(product)[row] - x * y) <= Fraction(float(product.radius[row]))
        assert abs(rationals(quotient)[row] - x / y) <= Fraction(float(quotient.radius[row]))


def test_division_by_what_may_be_zero_says_nothing() -> None:
    near_zero = Bundle(np.array([1e-20]), np.array([0.0]), np.array([1e-20]))

    with np.errstate(divide="ignore"):
        assert np.isinf((bundle(1)[:1] / near_zero).radius).all()


def test_a_sign_is_shared_parted_or_not_known() -> None:
    field = Bundles()
    zero = np.zeros(3)

    assert field.sign(Bundle(np.array([1.0, 2.0, 3.0]), zero, zero + 0.5)) == 1
    assert field.sign(Bundle(zero, zero, zero)) == 0
    assert field.sign(-7) == -1
    with pytest.raises(PartedError) as parted:
        field.sign(Bundle(np.array([1.0, -2.0, 1e-3]), zero, zero + 0.5))
    assert parted.value.signs.tolist() == [1, -1, 2]
    with pytest.raises(UndecidedError), precision(192):
        field.sign(field.number(fmpq(1, 3)) - field.number(fmpq(1, 3)))


@pytest.mark.parametrize("seed", range(4))
def test_bundles_answer_as_balls_do(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = random_scene(seed)
    bundled = ORACLE.render(scene, IMAGE_STAGES)

    monkeypatch.setattr(bundles, "FEWEST", 10**9)
    balls = ORACLE.render(scene, IMAGE_STAGES)

    for stage in IMAGE_STAGES:
        # Both are nearest to a middle that is off by less than 2^-7 ulp.
        known = np.isfinite(balls[stage])
        assert np.array_equal(bundled[stage][~known], balls[stage][~known], equal_nan=True)
        spacing = np.spacing(np.abs(balls[stage][known]))
        assert (np.abs(bundled[stage][known] - balls[stage][known]) <= spacing).all()
    assert np.array_equal(bundled[Stage.OBJECT], balls[Stage.OBJECT])
    assert np.array_equal(bundled[Stage.VISIBILITY], balls[Stage.VISIBILITY])


def test_most_pixels_are_certain_in_bundles_and_ties_are_handed_back() -> None:
    """A square whose edge runs exactly through the centres of a column: those pixels need exact numbers."""
    light = PointLight(position=(1.0, 0.5, 5.0), flux=(1.0, 2.0, 0.0))
    shapes = (Plane(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, -1))), Square(albedo=GREY, two_sided=True))
    view = looking_down(1.0, fovy=90.0, width=20, height=20)
    scene = Scene(camera=view, shapes=shapes, lights=(light,))
    rows, columns = np.mgrid[:20, :20]
    points = np.stack([columns, rows], axis=-1).reshape(-1, 2) + 0.5
    # Half a pixel to the left: x = -0.5 at column 5.
    points[:, 0] -= 0.5
    told = list(walk_suspects(scene, points))
    widths = [3, 2, 1, 3, 3, 1, 3, 3, 3]

    table, certain = bundles.walked(scene, points, told, Stage.RADIANCE, widths)

    ties = points[:, 0] == 5
    assert not certain[ties & (np.abs(points[:, 1] - 10) < 5)].any()
    assert certain[~ties].mean() > 0.6
    assert np.isfinite(table[certain][:, :3]).all()
    assert not table[certain][:, -1].any(), "no flux in blue"


def walk_suspects(scene: Scene, points: np.ndarray):
    from rayproof.reference.certified.filters import suspects

    return suspects(scene, points, lights=True)
