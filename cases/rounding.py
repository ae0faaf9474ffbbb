"""Unit roundoff and gamma(n), the parts of all limits.

Source: Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), section 3.1.
"""

UNIT_ROUNDOFF: dict[str, float] = {"float32": 2.0**-24, "float64": 2.0**-53}
PRECISIONS: tuple[str, ...] = tuple(UNIT_ROUNDOFF)


def gamma(n: float, *, precision: str) -> float:
    """Return the bound n u / (1 - n u) on the relative error of n successive roundings.

    Raises:
        LookupError: the precision is neither float32 nor float64.
        ValueError: n u >= 1, for which no bound exists.

    """
    if precision not in UNIT_ROUNDOFF:
        raise LookupError(f"no precision is called {precision!r}; known: {', '.join(UNIT_ROUNDOFF)}")
    accumulated = n * UNIT_ROUNDOFF[precision]
    if accumulated >= 1:
        raise ValueError(f"{n} roundings of {precision} have no relative bound")
    return accumulated / (1 - accumulated)
