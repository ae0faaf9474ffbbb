"""Many rays, each with inputs of its own: signs and values by bundles, exact rationals where a sign is in doubt.

The mathematics is written once, for numbers of any kind: bundles compute all rays at once, rationals decide the signs
that a bundle's radii leave open, and balls of many bits check a sample.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from flint import arb

from rayproof.reference.certified.bundles import UNKNOWN, Bundle, floats, signs_of
from rayproof.reference.certified.fields import exact, precision

Columns = dict[str, Any]  # named numbers, or triples of them: floats, exact numbers, intervals or Dr.Jit arrays
Mathematics = Callable[[Columns], Columns]
WITNESS_BITS = 512


def parts(inputs: Mapping[str, np.ndarray], number: Callable[[Any], Any]) -> Columns:
    """Return inputs (rays,) and (rays, k) as numbers that `number` makes from arrays, and tuples of k of them."""
    return {
        name: number(array) if array.ndim == 1 else tuple(number(array[:, i]) for i in range(array.shape[1]))
        for name, array in inputs.items()
    }


def single(inputs: Mapping[str, np.ndarray], ray: int, number: Callable[[float], Any]) -> Columns:
    """Return the inputs of a single ray as exact numbers that `number` makes."""
    return {
        name: number(float(array[ray])) if array.ndim == 1 else tuple(number(float(x)) for x in array[ray])
        for name, array in inputs.items()
    }


def decided(predicates: Mathematics, inputs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the sign (-1, 0, 1) of every predicate for every ray; rationals decide where bundles do not."""
    with np.errstate(all="ignore"):
        signs = {name: signs_of(value) for name, value in predicates(parts(inputs, floats)).items()}
    doubtful = np.flatnonzero(np.any([sign == UNKNOWN for sign in signs.values()], axis=0))
    for ray in doubtful:
        for name, value in predicates(single(inputs, int(ray), exact)).items():
            signs[name][ray] = (value > 0) - (value < 0)
    return {name: sign.astype(np.int8) for name, sign in signs.items()}


def evaluated(values: Mathematics, inputs: Mapping[str, np.ndarray]) -> dict[str, Bundle]:
    """Return every value of the mathematics for every ray, as bundles."""
    with np.errstate(all="ignore"):
        return values(parts(inputs, floats))


def witnessed(
    values: Mathematics, inputs: Mapping[str, np.ndarray], bundles: Mapping[str, Bundle], rays: np.ndarray
) -> tuple[int, float]:
    """Return the number of values of `rays` confirmed by balls of many bits, and the largest distance, relative.

    A value that is not finite (a root of a negative number, a division by zero) is confirmed by a ball that is not.
    """
    count, worst = 0, 0.0
    with precision(WITNESS_BITS):
        for ray in rays:
            balls = values(single(inputs, int(ray), arb))
            for name, ball in balls.items():
                if ball.is_zero():
                    continue
                pair = bundles[name]
                high = float(np.broadcast_to(pair.high, inputs_length(inputs))[ray])
                low = float(np.broadcast_to(pair.low, inputs_length(inputs))[ray])
                finite = np.isfinite(high) and np.isfinite(low)
                if not ball.is_finite():
                    count += not finite
                    continue
                if not finite:
                    continue
                count += 1
                worst = max(worst, float(abs((arb(high) + arb(low) - ball) / ball).upper()))
    return count, worst


def confirmed(
    predicates: Mathematics, inputs: Mapping[str, np.ndarray], signs: Mapping[str, np.ndarray], rays: np.ndarray
) -> tuple[int, float]:
    """Return the number of signs of `rays` compared with balls of many bits, and 1.0 if a ball contradicts, else 0.0.

    A ball that contains zero counts as the sign 0, a tie.
    """
    count, wrong = 0, False
    with precision(WITNESS_BITS):
        for ray in rays:
            for name, ball in predicates(single(inputs, int(ray), arb)).items():
                sign = int(bool(ball > 0)) - int(bool(ball < 0))
                count, wrong = count + 1, wrong or sign != int(signs[name][ray])
    return count, float(wrong)


def inputs_length(inputs: Mapping[str, np.ndarray]) -> int:
    """Return the number of rays."""
    return len(next(iter(inputs.values())))
