"""Special values put into ordinary inputs: value 1 one at a time, value 2 in every pair of places."""

from itertools import combinations, product

import numpy as np

from rayproof.cases.ladders.draws import directions, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs

TINIEST = {"float32": (2.0**-149, 2.0**-127), "float64": (2.0**-1074, 2.0**-1023)}
LARGEST = {"float32": float(np.finfo(np.float32).max), "float64": float(np.finfo(np.float64).max)}
PAIRS = 4000  # at most


def specials(precision: str) -> tuple[float, ...]:
    """Return NaN, infinities, subnormals, zeros and the largest numbers, of both signs where there are two."""
    tiny, small = TINIEST[precision]
    return (np.nan, np.inf, -np.inf, tiny, -tiny, small, -0.0, 0.0, LARGEST[precision], -LARGEST[precision])


def planted(draw: Draw, value: float = 1.0) -> Draw:
    """Return a draw that plants special values in the inputs of `draw` at `value`; without any it asks nothing."""

    def planting(places: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        plain = draw(value, 1, np.random.default_rng(5), precision)
        slots = [
            (name, index)
            for name, array in plain.items()
            if name not in ("fovy", "aspect", "near", "far")
            for index in np.ndindex(array.shape[1:])
        ]
        wanted = [
            [*zip(where, what, strict=True)]
            for where in combinations(slots, int(places))
            for what in product(specials(precision), repeat=int(places))
        ]
        if len(wanted) > max(count, 1000):
            wanted = [wanted[i] for i in np.sort(generator.choice(len(wanted), max(count, 1000), replace=False))]
        drawn = draw(value, len(wanted), generator, precision)
        for ray, plants in enumerate(wanted):
            for (name, index), special in plants:
                drawn[name][(ray, *index)] = special
        return drawn

    return planting


def dark(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return lights 1 exactly at the point, 2 behind the surface, 3 along it with n . L = +0 or -0."""
    normal = rounded(directions(count, generator), precision)
    away = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    if kind == 2:
        away = -normal * generator.uniform(0.5, 2, (count, 1))
    if kind == 3:
        # Swapped components with a changed sign, of so few digits that their products are exact: a right angle.
        normal = generator.integers(1, 9, (count, 3)) / 8.0
        normal[:, 2] = np.where(generator.random(count) < 0.5, -0.0, 0.0)
        away = np.stack([-normal[:, 1], normal[:, 0], generator.normal(size=count)], axis=1)
    return {"flux": np.full(count, 100.0), "normal": normal, "away": rounded(away, precision)}


def points(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return points of unit spheres whose centres are `offset` m from the origin."""
    center = rounded(directions(count, generator) * offset, precision)
    return {"p": rounded(center + directions(count, generator), precision), "c": center}


def edge_on(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit normals and directions with n . d about plus or minus `cosine`."""
    normal = directions(count, generator)
    side = np.where(generator.random((count, 1)) < 0.5, -1.0, 1.0)
    other = np.cross(normal, directions(count, generator))
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    direction = side * cosine * normal + np.sqrt(1 - cosine**2) * other
    return {"n": rounded(normal, precision), "d": rounded(direction, precision)}
