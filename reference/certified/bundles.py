"""Pairs of float64 with rigorous error radii for many pixels at once (`Bundle`), in place of balls."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, fmpq

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified.camera import view_of
from rayproof.reference.certified.fields import Balls, UndecidedError, Vector, precision
from rayproof.reference.certified.light_paths import Path, Suspects
from rayproof.reference.certified.truths import ABOUT_ZERO, NARROW, POSITION
from rayproof.reference.certified.worlds import ExactWorld

# Arrays of numbers of 100 bits with error radii: high + low in float64; the exact value differs by at most `radius`.
#
# Source: Dekker, "A floating-point technique for extending the available precision", Numerische Mathematik 18 (1971);
# Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of double-word arithmetic", ACM
# Transactions on Mathematical Software 44 (2017), whose bounds are at most 2^-101.9 for sums of equal signs, products
# and quotients. The radii here are larger. NaN in a radius fails every comparison that would accept the number.


SUM = 2.0**-102  # of the summands' magnitudes
PRODUCT = 2.0**-100
QUOTIENT = 2.0**-98
ROOT = 2.0**-98
SAFE = 1 + 2.0**-45  # covers the roundings of a radius
TINY = 1e-290  # covers products and their tails that underflow
SPLIT = 134217729.0  # 2^27 + 1
UNKNOWN = 2  # in place of a sign that the radius leaves open


class Bundle:
    """One number per pixel, or one for all. Integers and exact zeros may be used in place of bundles everywhere."""

    __slots__ = ("high", "low", "radius")

    def __init__(self, high: Any, low: Any, radius: Any) -> None:
        self.high, self.low, self.radius = high, low, radius

    def __neg__(self) -> "Bundle":
        return Bundle(-self.high, -self.low, self.radius)

    def __add__(self, other: "Bundle | int") -> "Bundle":
        if isinstance(other, int):
            if other == 0:
                return self
            other = whole(other)
        total, rest = _two_sum(self.high, other.high)
        high, low = _two_sum(total, rest + (self.low + other.low))
        size = np.abs(self.high) + np.abs(other.high)
        return Bundle(high, low, (self.radius + other.radius + size * SUM) * SAFE)

    __radd__ = __add__

    def __sub__(self, other: "Bundle | int") -> "Bundle":
        return self + -other

    def __rsub__(self, other: int) -> "Bundle":
        return -self + other

    def __mul__(self, other: "Bundle | int") -> Any:
        if isinstance(other, int):
            if other == 0:
                return 0
            if other == 1:
                return self
            other = whole(other)
        product, rest = _two_product(self.high, other.high)
        rest = rest + (self.high * other.low + self.low * other.high)
        high, low = _fast_two_sum(product, rest)
        size, other_size = np.abs(self.high), np.abs(other.high)
        spread = size * other.radius + self.radius * (other_size + other.radius)
        # The halves of a pair's size are off by 2^-53 of it, which SAFE covers.
        return Bundle(high, low, (spread + np.abs(high) * PRODUCT) * SAFE + TINY)

    __rmul__ = __mul__

    def __truediv__(self, other: "Bundle | int") -> "Bundle":
        if isinstance(other, int):
            other = whole(other)
        first = self.high / other.high
        product, rest = _two_product(first, other.high)
        remainder = ((self.high - product) - rest) + (self.low - first * other.low)
        high, low = _fast_two_sum(first, remainder / other.high)
        size = np.abs(other.high)
        spread = (self.radius + np.abs(high) * other.radius + TINY) / (size - other.radius)
        radius = (spread + np.abs(high) * QUOTIENT) * SAFE + TINY
        return Bundle(high, low, np.where(size > 2 * other.radius, radius, np.inf))

    def __rtruediv__(self, other: int) -> Any:
        return 0 if other == 0 else whole(other) / self

    def sqrt(self) -> "Bundle":
        """Return the square root, 0 of 0; the radius is infinite if the number may be zero or negative."""
        first = np.sqrt(self.high)
        divisor = np.where(first == 0, 1.0, first)
        product, rest = _two_product(first, first)
        remainder = ((self.high - product) - rest) + self.low
        high, low = _fast_two_sum(first, remainder / (2 * divisor))
        # |sqrt(a + r) - sqrt(a)| <= r / sqrt(a), for r at most half of a.
        radius = ((self.radius + TINY) / divisor + first * ROOT) * SAFE
        return Bundle(high, low, np.where(self.high > 2 * self.radius, radius, np.inf))

    def rsqrt(self) -> "Bundle":
        """Return 1 over the square root."""
        return 1 / self.sqrt()

    def __getitem__(self, index: Any) -> "Bundle":
        return Bundle(self.high[index], self.low[index], self.radius[index])


def floats(values: Any) -> Bundle:
    """Return float64 numbers, which are exact."""
    return Bundle(np.asarray(values, dtype=np.float64), np.float64(0), np.float64(0))


def signs_of(value: Bundle) -> np.ndarray:
    """Return -1, 0 or 1 per number, `UNKNOWN` where its radius leaves the sign open."""
    # The low part is no more than half a rounding of the high one.
    sure = np.abs(value.high) > value.radius * SAFE
    nought = (value.high == 0) & (value.radius == 0)
    return np.where(sure, np.sign(value.high), np.where(nought, 0, UNKNOWN))


def whole(value: int) -> Bundle:
    """Return a small whole number."""
    return Bundle(np.float64(value), np.float64(0), np.float64(0))


def larger(first: Any, second: Any, *, sign: int) -> Bundle:
    """Return the larger of two numbers, or the smaller for `sign` -1, with the larger of the two radii."""
    first, second = (whole(value) if isinstance(value, int) else value for value in (first, second))
    ahead = np.where(first.high == second.high, sign * (first.low - second.low), sign * (first.high - second.high)) > 0
    return Bundle(
        np.where(ahead, first.high, second.high),
        np.where(ahead, first.low, second.low),
        np.maximum(first.radius, second.radius),
    )


def _two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    total = a + b
    shifted = total - a
    return total, (a - (total - shifted)) + (b - shifted)


def _fast_two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """Return the sum and its rounding error; |a| >= |b|."""
    total = a + b
    return total, b - (total - a)


def _two_product(a: Any, b: Any) -> tuple[Any, Any]:
    product = a * b
    a_high, a_low = _halves(a)
    b_high, b_low = _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(a: Any) -> tuple[Any, Any]:
    scaled = a * SPLIT
    high = scaled - (scaled - a)
    return high, a - high


# Bundles as a field of the geometry: if the pixels differ in a sign, `PartedError` splits them into groups.


class PartedError(Exception):
    """The pixels of a bundle do not share a sign; `signs` has -1, 0 or 1 per pixel, or 2 if it is undecided."""

    def __init__(self, signs: np.ndarray) -> None:
        super().__init__("a bundle's pixels part here")
        self.signs = signs


class Bundles:
    """Field of numbers for many pixels at once. Constants are made from balls, so use it inside `precision`."""

    def number(self, value: fmpq) -> Any:
        """Return a rational number; zero as an integer, whose arithmetic is skipped."""
        return constant(arb(value)) if value else 0

    def float(self, value: float) -> Any:
        """Return a finite float, which is exact."""
        return constant(arb(value)) if value else 0

    def pi(self) -> Bundle:
        """Return pi."""
        return constant(arb.pi())

    def sqrt(self, value: Bundle) -> Bundle:
        """Return the square root."""
        return value.sqrt()

    def rsqrt(self, value: Bundle) -> Bundle:
        """Return 1 over the square root."""
        return value.rsqrt()

    def tan_degrees(self, angle: fmpq) -> Bundle:
        """Return the tangent of an angle [degrees]."""
        return constant(arb.tan_pi(arb(angle / 180)))

    def sign(self, value: Any) -> int:
        """Return the sign that all pixels share.

        Raises:
            PartedError: the pixels differ in sign.
            UndecidedError: the sign of a constant is undecided.

        """
        if isinstance(value, int):
            return (value > 0) - (value < 0)
        signs = signs_of(value)
        first = signs.flat[0]
        if first != UNKNOWN and (signs == first).all():
            return int(first)
        if signs.ndim == 0:
            raise UndecidedError
        raise PartedError(signs)

    def largest(self, values: list[Any]) -> Bundle:
        """Return the largest number, pixel by pixel."""
        answer = values[0]
        for value in values[1:]:
            answer = larger(answer, value, sign=1)
        return answer

    def smallest(self, values: list[Any]) -> Bundle:
        """Return the smallest number, pixel by pixel."""
        answer = values[0]
        for value in values[1:]:
            answer = larger(answer, value, sign=-1)
        return answer


def constant(value: arb) -> Bundle:
    """Return a ball's number as a bundle that all pixels share."""
    high = float(value)
    low = float(value - arb(high))
    rest = abs(value - arb(high) - arb(low))
    radius = 0.0 if rest.is_zero() else float(rest.upper()) * SAFE + TINY
    return Bundle(np.float64(high), np.float64(low), np.float64(radius))


# Whole images by bundles: pixels with the same suspects are computed together until their decisions differ.
#
# The geometry is that of the balls, in another field. A pixel whose decision or value the radii leave open is returned
# as uncertain.


BITS = 192  # of the balls that constants are made from
# Balls take 60 us per pixel; a bundle takes about 3 ms, even for few pixels.
FEWEST = 32


def walked(
    scene: Scene, points: np.ndarray, suspects: Sequence[Suspects], last: Stage, widths: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return all stages up to `last` at image points (N, 2) [px], one row per point, and a mask (N,) of certain rows.

    `widths` are the stages' numbers of channels. A certain row contains float64 numbers within one ulp of the truth.
    """
    table, certain = np.full((len(points), sum(widths)), np.nan), np.zeros(len(points), dtype=bool)
    together: dict[int, list[int]] = defaultdict(list)
    for row, suspect in enumerate(suspects):
        together[id(suspect)].append(row)
    waiting = [np.array(rows) for rows in together.values() if len(rows) >= FEWEST]
    if not waiting:
        return table, certain
    number = IMAGE_STAGES.index(last)
    with precision(BITS), np.errstate(all="ignore"):
        world, directions = ExactWorld(scene, Bundles()), _directions(scene, points)
        while waiting:
            rows = waiting.pop()
            path = Path(world, _some(directions, rows), number)
            try:
                decisions = path.decide(suspects[rows[0]], leave_open=False)
            except PartedError as parted:
                parts = [rows[parted.signs == sign] for sign in (-1, 0, 1)]
                waiting += [part for part in parts if len(part) >= FEWEST]
                continue
            except UndecidedError:
                continue
            table[rows], certain[rows] = _told(path.values(decisions)[: number + 1], path.t, len(rows), widths)
    return table, certain


def _directions(scene: Scene, points: np.ndarray) -> Vector:
    """Return the directions of depth 1 through image points (N, 2) [px]."""
    camera = scene.camera
    view = view_of(camera, Balls(BITS))
    half = np.zeros(len(points))
    x = Bundle(2 * points[:, 0], half, half) / camera.width - 1
    y = 1 - Bundle(2 * points[:, 1], half, half) / camera.height
    x, y = x * constant(view.half_width), y * constant(view.half_height)
    axes = zip(view.forward, view.right, view.up, strict=True)
    x_part, y_part, z_part = (x * constant(right) + y * constant(up) + constant(forward) for forward, right, up in axes)
    return (x_part, y_part, z_part)


def _some(vector: Vector, rows: np.ndarray) -> Vector:
    return (vector[0][rows], vector[1][rows], vector[2][rows])


def _told(values: Sequence[Sequence[Any]], t: Any, count: int, widths: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the values as float64 rows, and a mask of the rows that are as narrow as `truths.narrow` requires."""
    table, narrow = np.empty((count, sum(widths))), np.ones(count, dtype=bool)
    column = 0
    for number, stage in enumerate(values):
        balls = [value for value in stage if isinstance(value, Bundle)]
        largest = np.max([np.broadcast_to(np.abs(ball.high), count) for ball in balls], axis=0) if balls else 0.0
        if number == POSITION:
            largest = np.maximum(largest, np.abs(t.high) if isinstance(t, Bundle) else 0)
        for value in stage:
            if isinstance(value, Bundle):
                close = value.radius <= np.abs(value.high) * 2.0**-NARROW
                narrow &= close | (value.radius <= largest * 2.0 ** -(NARROW + ABOUT_ZERO))
                table[:, column] = value.high
            else:
                table[:, column] = value
            column += 1
    return table, narrow
