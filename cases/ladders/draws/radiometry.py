"""Contributions of lights, albedos and exitances."""

import numpy as np

from rayproof.cases.ladders.draws import rounded
from rayproof.cases.ladders.ladder import Inputs

MOST = 64  # lights


def _lights(parts: np.ndarray, precision: str) -> Inputs:
    return {f"light{k}": column for k, column in enumerate(rounded(parts, precision).T)}


def of_all_sizes(spread: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return eight contributions whose sizes are spread evenly over a range of `spread`, in any order."""
    sizes = spread ** (generator.permuted(np.tile(np.linspace(-0.5, 0.5, 8), (count, 1)), axis=1))
    return _lights(sizes * generator.uniform(0.5, 1, (count, 8)), precision)


def many(lights: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return `lights` contributions of about one size, and nothing from the others of MOST."""
    parts = generator.uniform(0.5, 1, (count, MOST))
    parts[:, int(lights) :] = 0
    return _lights(parts, precision)


def leaving(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return albedos, and irradiances of about `size`, in three channels."""
    albedo, irradiance = generator.uniform(0.01, 1, (2, count, 3))
    return {"albedo": rounded(albedo, precision), "irradiance": rounded(irradiance * size, precision)}


def exitances(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return exitances of about `size`."""
    return {"exitance": rounded(generator.uniform(0.1, 1, count) * size, precision)}
