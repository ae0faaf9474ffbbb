"""`truths`: rising precision until all branches are decided and all balls are narrow, and exact numbers for ties."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, ctx

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified.fields import MOST, START, UndecidedError
from rayproof.reference.certified.light_paths import Decisions, Path, Suspects, Values
from rayproof.reference.certified.worlds import Worlds

BEFORE_EXACT = 512  # bits at which an undecided branch is treated as a tie and decided by exact numbers
INEXACT = 256  # bits at which it is left undecided if exact numbers are not requested
NARROW = 60  # bits of relative accuracy: half an ulp of float64, and 2^-7 of it
ABOUT_ZERO = 40  # additional bits, relative to a vector's length, for a component that is about zero

POSITION, EXITANCE = IMAGE_STAGES.index(Stage.POSITION), IMAGE_STAGES.index(Stage.EXITANCE)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The certain values at one image point."""

    values: Values
    bits: int
    exactly: bool  # whether exact numbers decided a tie that balls left open
    undecided: tuple[str, ...]


def truths(
    scene: Scene,
    points: Iterable[tuple[float, float]],
    suspects: Iterator[Suspects],
    last: Stage,
    *,
    exactly: bool = True,
) -> Iterator[Truth]:
    """Yield the end-to-end truth of image points [px], of the image stages up to `last`.

    Without `exactly` a tie is left undecided: exact numbers take a thousand times as long.
    """
    worlds, number = Worlds(scene), IMAGE_STAGES.index(last)
    for point, suspect in zip(points, suspects, strict=True):
        before = ctx.prec
        try:
            truth = _truth(worlds, point, suspect, number, exactly=exactly)
        finally:
            ctx.prec = before
        yield truth


def _truth(worlds: Worlds, point: tuple[float, float], suspects: Suspects, last: int, *, exactly: bool) -> Truth:
    decisions, path, bits = _decided(worlds, point, suspects, last, exactly=exactly)
    exactly = path is None
    while True:
        ctx.prec = bits
        if path is None:
            world = worlds.balls(bits)
            path = Path(world, world.direction(*point), last)
            path.follow(decisions)
        values = path.values(decisions)
        if bits == MOST or narrow(values, path.t):
            return Truth(values=values, bits=bits, exactly=exactly, undecided=decisions.open)
        bits, path = 2 * bits, None


def _decided(
    worlds: Worlds, point: tuple[float, float], suspects: Suspects, last: int, *, exactly: bool
) -> tuple[Decisions, Path | None, int]:
    """Return the decisions, the path in balls that decided them (None: exact numbers did), and the precision [bits]."""
    bits = START
    most = BEFORE_EXACT if exactly else INEXACT
    while bits <= most:
        ctx.prec = bits
        world = worlds.balls(bits)
        path = Path(world, world.direction(*point), last)
        try:
            return path.decide(suspects, leave_open=bits == most and not exactly), path, bits
        except UndecidedError:
            bits *= 2
    world = worlds.tower()
    return Path(world, world.direction(*point), last).decide(suspects, leave_open=True), None, START


def narrow(values: Values, t: Any) -> bool:
    """Return whether every ball is narrower than 2^-NARROW of itself, or about zero compared with its stage's others.

    A position is compared with the hit's depth too, because it may be the origin. Exitance and radiance are multiples
    of the irradiance, so they are as narrow as it is and need no test.
    """
    for number, balls in enumerate(values[:EXITANCE]):
        for ball in balls:
            if isinstance(ball, arb) and ball.rel_accuracy_bits() < NARROW:
                largest = max(abs(float(component)) for component in balls)
                if number == POSITION:
                    largest = max(largest, abs(float(t)))
                if not float(ball.rad()) <= largest * 2.0 ** -(NARROW + ABOUT_ZERO):
                    return False
    return True


def rounded(values: Sequence[Any]) -> list[float]:
    """Return the float64 numbers nearest to the middles of balls."""
    return [float(value) for value in values]


def enclosed(value: Any) -> tuple[float, float]:
    """Return the float64 numbers next below and above a ball, equal if the ball is a float64; a plain number twice."""
    if not isinstance(value, arb):
        return value, value
    below, above = value.lower(), value.upper()
    low, high = float(below), float(above)
    # Beyond the largest float64 the nearest one is infinite, which is no bound.
    if low == math.inf or (math.isfinite(low) and arb(low) > below):
        low = math.nextafter(low, -math.inf)
    if high == -math.inf or (math.isfinite(high) and arb(high) < above):
        high = math.nextafter(high, math.inf)
    return low, high
