"""Ladders of ray and sphere (far, tangent, inside, scaled), of sphere normals, and of hit points on all shapes."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import (
    Failure,
    Gate,
    Inputs,
    Ladder,
    PredictedSlope,
    across,
    directions,
    flat_shapes,
    rounded,
    triangles,
)
from rayproof.cases.placement import unit


# Draws. Rays at spheres.
def _towards(
    count: int,
    generator: np.random.Generator,
    precision: str,
    *,
    distance: np.ndarray | float,
    impact: np.ndarray,
    radius: float = 1.0,
    offset: float = 0.0,
    speed: float = 1.0,
) -> Inputs:
    """Return rays that pass a sphere's centre at `impact` radii, from `distance` m; the sphere within `offset` m."""
    center = offset * directions(count, generator)
    away = directions(count, generator)
    origin = center + away * np.reshape(distance, (-1, 1))
    side = across(away, generator)
    foot = center + side * (impact * radius)[:, None]
    direction = foot - origin
    direction = speed * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return {
        "o": rounded(origin, precision),
        "d": rounded(direction, precision),
        "c": rounded(center, precision),
        "r": rounded(np.full(count, radius), precision),
    }


def far(ratio: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere seen from `ratio` radii, impact 0 to 1.2 radii."""
    impact = generator.uniform(0, 1.2, count)
    return _towards(count, generator, precision, distance=1 + ratio, impact=impact)


def far_small(ratio: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a sphere of radius 1 / ratio seen from 10 m, impact 0 to 1.2 radii."""
    impact = generator.uniform(0, 1.2, count)
    return _towards(count, generator, precision, distance=10.0, impact=impact, radius=1 / ratio)


def tangent(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that pass within `margin` radii of the outline, inside or outside it."""
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    distance = 5.0
    # The impact parameter of a ray aimed at a point `p` from the centre, at a right angle to the way, is smaller.
    impact = 1 - side * margin
    aimed = impact / np.sqrt(1 - (impact / distance) ** 2)
    return _towards(count, generator, precision, distance=distance, impact=aimed)


def near(height: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays downwards from `height` radii above a unit sphere."""
    away = directions(count, generator)
    slope = np.sqrt(generator.uniform(0.05, 1.0, count))[:, None]
    direction = -slope * away + np.sqrt(1 - slope**2) * across(away, generator)
    return {
        "o": rounded(away * (1 + height), precision),
        "d": rounded(direction, precision),
        "c": np.zeros((count, 3)),
        "r": np.ones(count),
    }


def inside(depth: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays in all directions from `depth` radii below a unit sphere's surface."""
    return {
        "o": rounded(directions(count, generator) * (1 - depth), precision),
        "d": rounded(directions(count, generator), precision),
        "c": np.zeros((count, 3)),
        "r": np.ones(count),
    }


def perpendicular(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays with f . d = 0 exactly, f of `distance` radii along an axis, with zeros of both signs."""
    axis = generator.integers(3, size=count)
    zero = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    o, d = zero.copy(), np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    rows = np.arange(count)
    o[rows, axis] = np.where(generator.random(count) < 0.5, -distance, distance)
    flat = generator.normal(size=(count, 2))
    flat = rounded(unit(flat), precision)
    d[rows, (axis + 1) % 3], d[rows, (axis + 2) % 3] = flat.T
    return {"o": o, "d": d, "c": np.zeros((count, 3)), "r": np.ones(count)}


def translated(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere and an eye 2 radii away, both moved by `offset` radii."""
    impact = generator.uniform(0, 0.9, count)
    return _towards(count, generator, precision, distance=2.0, impact=impact, offset=offset)


def scaled(scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a sphere of radius `scale` m seen from 2 radii by unit directions."""
    drawn = _towards(count, generator, precision, distance=2.0, impact=generator.uniform(0, 0.9, count))
    return drawn | {name: rounded(drawn[name] * scale, precision) for name in ("o", "c", "r")}


def fast(speed: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere seen from 2 radii by directions of length `speed`."""
    return _towards(count, generator, precision, distance=2.0, impact=generator.uniform(0, 0.9, count), speed=speed)


def behind(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that leave a unit sphere at `distance` radii behind them: every one misses."""
    drawn = _towards(count, generator, precision, distance=1 + distance, impact=generator.uniform(0, 0.9, count))
    return drawn | {"d": -drawn["d"]}


def points(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return points of unit spheres whose centres are `offset` m from the origin."""
    center = rounded(directions(count, generator) * offset, precision)
    return {"p": rounded(center + directions(count, generator), precision), "c": center}


# Ladders of ray and sphere. sphere/float64 solves the textbook's quadratic in float64: its errors are as small as those
# of any formula in float32, and are the textbook's in float64.
QUADRATICS = ("textbook", "half_b", "stable_quadratic", "kahan", "first_positive")
IN_FLOAT64 = (*QUADRATICS, "float64")
K_LOCAL = "(|n| . (|o - c| + |t d|) + r) / (|n . d| |t|): the sphere's centre is the origin"
HALF_DECADES = (*(float(f"{digit}e{decade}") for decade in range(1, 8) for digit in (1, 3)), 1e8)
SQUARED = "the discriminant is a difference of squares of the distance: u (D / r)^2"
CANCELLING = Failure(formulas=QUADRATICS, because="squares of the distance cancel: from 4 K u at D / r = 2 on")
TEXTBOOK = Failure(formulas=("float64",), because="in float64 it is the textbook form", precisions=("float64",))
LINEAR = "the closest point is off by u D, and nothing is squared before the subtraction"


def _ladder(**about: Any) -> Ladder:
    options = {"shape": "sphere", "natural": about.pop("natural", "roundings")}
    fields: dict[str, Any] = {
        "group": "sphere",
        "question": "distance",
        "slots": ("sphere",),
        "condition": K_LOCAL,
        "unit": "u t",
    }
    return Ladder(**(fields | about), options=options)


DISTANCES = (
    _ladder(
        name="SPH-FAR",
        parameter="distance / radius",
        values=HALF_DECADES,
        draw=far,
        unit="|dt| / r",
        natural="radii",
        rays=4000,
        quick_rays=1000,
        gate=Gate(reaches={"float32": 1e5, "float64": 1e8}),
        fails=(CANCELLING, TEXTBOOK),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift",
        slopes=(
            PredictedSlope(formulas=QUADRATICS, slope=1.97, because=SQUARED),
            PredictedSlope(formulas=("float64",), slope=1.97, because=SQUARED, precisions=("float64",)),
            PredictedSlope(formulas=("*",), slope=0.98, because=LINEAR),
        ),
    ),
    _ladder(
        name="SPH-SMALL",
        parameter="1 / radius [1/m], seen from 10 m",
        values=(1.0, 3.0, 1e1, 3e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=far_small,
        unit="|dt| / r",
        natural="radii",
        gate=Gate(reaches={"float32": 1e4, "float64": 1e7}),
        fails=(CANCELLING, TEXTBOOK),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift",
        slopes=(
            PredictedSlope(formulas=("float64",), slope=1.0, because=LINEAR, precisions=("float32",)),
            PredictedSlope(formulas=IN_FLOAT64, slope=1.97, because=SQUARED),
            PredictedSlope(formulas=("*",), slope=0.98, because=LINEAR),
        ),
    ),
    _ladder(
        name="SPH-TAN",
        parameter="distance of the ray from the outline [r]",
        values=(1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7),
        draw=tangent,
        rays=4000,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-7}),
        fails=(Failure(formulas=QUADRATICS, because="D is a difference of squares: 4 to 130 K u"), TEXTBOOK),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift; no float32 form at 1e-7, which is u",
        slopes=(
            PredictedSlope(
                formulas=("float64",),
                slope=0.0,
                precisions=("float32",),
                because="one rounding, of the result, is left",
            ),
            PredictedSlope(
                formulas=("*",), slope=-0.5, because="K is (2 delta)^(-1/2); the forms differ in the constant"
            ),
        ),
    ),
    _ladder(
        name="SPH-NEAR",
        parameter="height above the surface [r]",
        values=(1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6),
        draw=near,
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-6}),
        saturated=float("inf"),
        first_to_break="every float32 form alike",
        survivor="sphere/stable_quadratic in float64 on float32 inputs",
        slopes=(
            PredictedSlope(
                formulas=("float64",),
                slope=0.0,
                precisions=("float32",),
                because="squares of float32 numbers are exact in float64: Blinn's rearrangement pays completely",
            ),
            PredictedSlope(formulas=("*",), slope=-1.0, because="f . f - r^2 is left with u / h: K is 2 r / h"),
        ),
    ),
    _ladder(
        name="SPH-IN",
        parameter="depth below the surface [r], seen from inside",
        values=(1.0, 0.9, 0.5, 0.1, 1e-2, 1e-3),
        draw=inside,
        gate=Gate(reaches={"float32": 1e-2, "float64": 1e-3}),
        saturated=float("inf"),
        first_to_break="sphere/first_positive",
        survivor="all others: one root is behind, the other is far",
    ),
    _ladder(
        name="SPH-H0",
        parameter="distance [r] of an origin with f . d = 0 exactly; zeros of both signs",
        values=(0.5, 0.25, 0.125, 2.0**-10, 2.0**-20, 2.0**-30, 2.0, 1024.0),
        draw=perpendicular,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1024.0, "float64": 1024.0}, misclassified=0.0),
        first_to_break="a stable quadratic with sign(0) = 0",
        survivor="all here: copysign",
    ),
    _ladder(
        name="SPH-ORG",
        parameter="distance of sphere and eye from the world's origin [r]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=translated,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e5, "float64": 1e6}),
        first_to_break="the inputs, not a formula: end to end u T / r",
        survivor="all: o - c is subtracted first and K_local is flat",
        slopes=(PredictedSlope(formulas=("*",), slope=0.0, because="the formula only sees o - c"),),
    ),
    _ladder(
        name="SPH-LARGE",
        parameter="uniform scale [m]",
        values=(1.0, 1e4, 1e8, 1e9, 1e10, 1e14, 1e18, 1e19, 1e20),
        draw=scaled,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e9, "float64": 1e20}),
        first_to_break="sphere/textbook: products of four lengths overflow at 1e19 in float32",
        survivor="sphere/shift up to 1e19",
    ),
    _ladder(
        name="SPH-TINY",
        parameter="uniform scale [m]",
        values=(1.0, 1e-4, 1e-8, 1e-9, 1e-10, 1e-12, 1e-16, 1e-18, 1e-20, 1e-22),
        draw=scaled,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-22}),
        first_to_break="sphere/textbook: products of four lengths lose digits to subnormals below 1e-10 in float32",
        survivor="sphere/shift down to 1e-18",
        measured="predicted: digits fade from 1e-19; from 1e-18 measured, where squares are subnormal and flushed",
    ),
    _ladder(
        name="SPH-FAST",
        parameter="length of the direction",
        values=(1.0, 1e2, 1e4, 1e6, 1e8, 1e10, 1e15, 1e18),
        draw=fast,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e8, "float64": 1e18}),
        first_to_break="sphere/textbook",
        survivor="sphere/shift",
    ),
    _ladder(
        name="SPH-SLOW",
        parameter="length of the direction",
        values=(1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-15, 1e-18),
        draw=fast,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-18}),
        first_to_break="sphere/textbook",
        survivor="sphere/shift",
    ),
    _ladder(
        name="SPH-BEHIND",
        parameter="distance [r] of a sphere behind the ray",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1.0, 1e2, 1e4),
        draw=behind,
        kind="count",
        gate=Gate(reaches={"float32": 1e4, "float64": 1e4}, misclassified=0.0),
        fails=(Failure(formulas=("first_positive",), because="erratum E3: takes a root behind the ray"),),
        first_to_break="a form whose far root may round to a positive number",
        survivor="all",
    ),
)


# Ladders of points on spheres, planes and triangles, and of the normals on spheres.
POINTS = (
    Ladder(
        name="SPH-POINT-FAR",
        group="sphere",
        question="point",
        slots=("position",),
        parameter="distance / radius",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=far,
        unit="distance from the surface [r]",
        condition="(|c| + r) / r: a point cannot be closer than its own rounding",
        options={"shape": "sphere"},
        rays=2000,
        gate=Gate(reaches={"float32": 1e5, "float64": 1e6}),
        fails=(
            Failure(
                formulas=("along_ray", "by_matrix"), because="o + t d is rounded at the size of t, not of the sphere"
            ),
        ),
        first_to_break="position/along_ray, position/by_matrix",
        survivor="position/reprojected",
        slopes=(
            PredictedSlope(formulas=("reprojected",), slope=0.0, because="the radius is restored last"),
            PredictedSlope(formulas=("*",), slope=1.0, because="o + t d rounds at the size of t: u D"),
        ),
    ),
    Ladder(
        name="SPH-POINT-NORMAL",
        group="sphere",
        question="sphere_normal",
        slots=("sphere_normal",),
        parameter="distance of the centre from the world's origin [r]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=points,
        unit="degrees",
        condition="1: p - c is exact or nearly so",
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(Failure(formulas=("center_kept",), because="erratum E17: the centre is not subtracted"),),
        first_to_break="sphere_normal/center_kept",
        survivor="sphere_normal/from_center",
        saturated=float("inf"),
        slopes=(PredictedSlope(formulas=("from_center",), slope=0.0, because="the formula only sees p - c"),),
    ),
    *(
        Ladder(
            name=f"PNT-{shape.upper()}",
            group="triangle, square, plane",
            question="point",
            slots=("position",),
            parameter="distance of the eye [m]",
            values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
            draw=draw,
            unit="m",
            condition="|n| . (|o| + |t d| + |a|): o + t d is rounded at the size of the way",
            options={"shape": shape},
            gate=Gate(reaches={"float32": reach, "float64": 1e6}),
            first_to_break="all alike; Pharr et al. (2023), 6.8: a point by barycentric coordinates would not",
            survivor="none: a point by o + t d rounds at the size of t",
            saturated=float("inf"),
            slopes=(PredictedSlope(formulas=("*",), slope=1.0, because="o + t d rounds at the size of t: u D"),),
        )
        for shape, draw, reach in (("plane", flat_shapes.plane_far, 1e6), ("triangle", triangles.well_shaped, 1e3))
    ),
)

LADDERS = (*DISTANCES, *POINTS)
