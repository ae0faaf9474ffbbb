"""Witnesses for questions about special values: what balls make of numbers that are none."""

from collections.abc import Mapping

import numpy as np
from flint import arb, ctx

from rayproof.reports.studies.stability.exactly import WITNESS_BITS, Mathematics, single
from rayproof.reports.studies.stability.questions import Witness

MOST = 200  # rays


def impossible(values: Mathematics, inputs: Mapping[str, np.ndarray], asked: np.ndarray) -> Witness:
    """Return the witness that what is asked of the rays `asked` (rays,) bool has no finite answer.

    A ball around NaN stays no number through whatever it takes part in. A sample of rays is worked out by `values`; one
    whose values all come out finite contradicts the truth, which is then a whole 1 from its witness.
    """
    rays = np.flatnonzero(asked)
    chosen = rays[:: max(1, len(rays) // MOST)]
    worst = 0.0
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in chosen:
            balls = values(single(inputs, int(ray), arb)).values()
            if all(ball.is_finite() for ball in balls):
                worst = 1.0
    finally:
        ctx.prec = old
    return Witness(len(chosen), worst)


def dark(inputs: Mapping[str, np.ndarray]) -> Witness:
    """Return the witness that no light arrives: each light lies at its point, or not above the point's horizon."""
    rays = np.arange(0, len(inputs["flux"]), max(1, len(inputs["flux"]) // MOST))
    worst = 0.0
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in rays:
            x = single(inputs, int(ray), arb)
            height = sum((n * a for n, a in zip(x["normal"], x["away"], strict=True)), arb(0))
            if not height <= 0:
                worst = 1.0
    finally:
        ctx.prec = old
    return Witness(len(rays), worst)
