"""How large the cache may become. Apart from the store, so that the command line can check a limit before all else."""

import math
import os

LIMIT_VARIABLE = "RAYPROOF_CACHE_LIMIT"  # the environment variable that names another limit [GiB]
LIMIT = 2 * 2**30  # bytes: three default suites
MOST = 2.0**33  # GiB


def usual_limit() -> int:
    """Return how large the store may become [bytes]: RAYPROOF_CACHE_LIMIT [GiB], or the usual limit.

    Raises:
        ValueError: the variable's value is no positive number of GiB.

    """
    text = os.environ.get(LIMIT_VARIABLE)
    return LIMIT if not text else limit_of(text, said_by=LIMIT_VARIABLE)


def limit_of(text: str, *, said_by: str) -> int:
    """Return a limit [bytes] of its text [GiB]; raise ValueError, which names `said_by`, if it is none."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value <= MOST:
        raise ValueError(f"{said_by} must be positive and at most {MOST:g} GiB, got {text}")
    return int(value * 2**30)
