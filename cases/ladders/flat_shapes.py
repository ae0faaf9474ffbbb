"""Ladders of ray and plane (grazing, far, parallel) and of ray and square (at the border, uneven, sheared)."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Failure, Gate, Inputs, Ladder, PredictedSlope, directions, rounded, transforms
from rayproof.cases.placement import unit


# Draws. Rays at planes and squares.
def plane_grazing(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from about 1 m above z = 0 at this cosine of incidence."""
    turn = generator.uniform(0, 2 * np.pi, count)
    flat = np.sqrt(1 - cosine**2)
    direction = np.stack([flat * np.cos(turn), flat * np.sin(turn), np.full(count, -cosine)], axis=1)
    return {"o": rounded(generator.uniform(0.5, 1.5, (count, 3)), precision), "d": rounded(direction, precision)}


def plane_far(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at z = 0 from `distance` m."""
    direction = directions(count, generator)
    direction[:, 2] = -abs(direction[:, 2]) - 0.05
    return {
        "o": rounded(generator.uniform(0.5, 1.5, (count, 3)) * distance, precision),
        "d": rounded(unit(direction), precision),
    }


def plane_parallel(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays along z = 0: 1 above it, 2 in it, 3 in it from z = -0; with d.z = +0 and -0. All miss."""
    drawn = plane_far(1.0, count, generator, precision)
    drawn["d"][:, 2] = np.where(generator.random(count) < 0.5, 0.0, -0.0)
    if kind > 1:
        drawn["o"][:, 2] = 0.0 if kind == 2 else -0.0
    return drawn


def border(spacings: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that meet z = 0 about `spacings` roundoffs inside or outside the unit square's border."""
    u = 2.0**-24 if precision == "float32" else 2.0**-53
    hit = generator.uniform(-0.45, 0.45, (count, 3))
    side = np.where(generator.random(count) < 0.5, -0.5, 0.5)
    off = 1 + spacings * u * generator.uniform(-1, 1, count)
    axis = generator.integers(2, size=count)
    hit[np.arange(count), axis] = side * off
    hit[:, 2] = 0.0
    # Powers of two along the ray make the point that it meets a float, so that it can lie this close.
    direction = generator.integers(-3, 4, (count, 3)) / 4.0
    direction[:, 2] = -1.0
    hit = rounded(hit, precision)
    return {"o": rounded(hit - direction, precision), "d": direction}


# The ladders.
TWICE_THE_SIZE = Failure(formulas=("full_vectors",), because="erratum E7: twice the size")


def _ladder(shape: str, **about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "triangle, square, plane",
        "question": "distance",
        "slots": (shape,),
        "condition": "(|o.z| + |t d.z|) / (|d.z| |t|) = 2",
        "unit": "u t",
        "saturated": float("inf"),
        "options": {"shape": shape, "natural": "roundings"},
    }
    return Ladder(**(fields | about))


LADDERS = (
    _ladder(
        "plane",
        name="PLN-GRAZE",
        parameter="cosine of incidence",
        values=(1.0, 0.5, 0.1, 1e-2, 1e-4, 1e-6, 1e-8),
        draw=plane_grazing,
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-8}),
        first_to_break="none: in object space the normal is exact",
        survivor="all",
        slopes=(PredictedSlope(formulas=("*",), slope=0.0, because="-o.z / d.z is one division of exact numbers"),),
    ),
    _ladder(
        "plane",
        name="PLN-FAR",
        parameter="distance of the eye [m]",
        values=(1.0, 1e3, 1e6, 1e9, 1e18, 1e30),
        draw=plane_far,
        gate=Gate(reaches={"float32": 1e30, "float64": 1e30}),
        first_to_break="none",
        survivor="all",
        slopes=(PredictedSlope(formulas=("*",), slope=0.0, because="-o.z / d.z is one division of exact numbers"),),
    ),
    _ladder(
        "plane",
        name="PLN-PAR",
        parameter="rays along the plane: 1 above it, 2 in it, 3 in it from z = -0",
        values=(1.0, 2.0, 3.0),
        draw=plane_parallel,
        kind="count",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 3.0, "float64": 3.0}, misclassified=0.0),
        first_to_break="plane/unguarded",
        survivor="plane/dot_products",
    ),
    _ladder(
        "square",
        name="SQ-BND",
        parameter="distance of the hit from the border [u]",
        values=(1e6, 1e5, 1e4, 1e3, 1e2, 3e1, 1e1, 3.0),
        draw=border,
        rays=4000,
        gate=Gate(reaches={"float32": 1e1, "float64": 1e1}),
        fails=(TWICE_THE_SIZE,),
        first_to_break="square/full_vectors",
        survivor="all others",
    ),
    _ladder(
        "square",
        name="SQ-RATIO",
        question="placed_distance",
        parameter="width / height",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=transforms.rays(transforms.stretched, reach=0.9, flat=True),
        condition="K_local of the plane z = 0 in exact object space",
        gate=Gate(reaches={"float32": 1e3, "float64": 1e6}, index=float("inf")),
        fails=(TWICE_THE_SIZE,),
        first_to_break="square/full_vectors",
        survivor="square/local",
    ),
    _ladder(
        "square",
        name="SQ-SHEAR",
        question="placed_distance",
        parameter="slant: how far y leans towards x",
        values=(0.25, 1.0, 1e1, 1e2, 1e3),
        draw=transforms.rays(transforms.sheared, reach=0.9, flat=True),
        condition="K_local of the plane z = 0 in exact object space",
        gate=Gate(reaches={"float32": 1e1, "float64": 1e3}, index=float("inf")),
        fails=(TWICE_THE_SIZE,),
        first_to_break="square/full_vectors; vectors without a Gram matrix",
        survivor="square/local, half_vectors",
    ),
)
