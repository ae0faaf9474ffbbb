"""Ladders of ray and box, and of a box's normal: seeded draws of rays at silhouettes, edges, corners and plates."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Failure, Gate, Inputs, Ladder, directions, rounded
from rayproof.cases.placement import unit


# Draws. Rays at the cube of half-size 0.5.
def _orders(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return np.argsort(generator.random((count, 3)), axis=1), np.where(generator.random((count, 3)) < 0.5, -1.0, 1.0)


def _placed(o: np.ndarray, d: np.ndarray, generator: np.random.Generator, precision: str) -> Inputs:
    """Return the same rays seen from all sides of the cube."""
    order, sign = _orders(len(o), generator)
    return {
        "o": rounded(np.take_along_axis(o, order, axis=1) * sign, precision),
        "d": rounded(np.take_along_axis(d, order, axis=1) * sign, precision),
    }


def silhouette(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points of edges that bound the cube's outline, from `distance` m."""
    edge = np.stack([np.full(count, 0.5), np.full(count, 0.5), generator.uniform(-0.45, 0.45, count)], axis=1)
    # Seen from between the two faces' own half-spaces, one face is visible and the other not.
    away = np.stack(
        [generator.uniform(0.1, 1, count), -generator.uniform(0.1, 1, count), generator.normal(size=count) / 2], axis=1
    )
    origin = rounded(edge + unit(away) * distance, precision)
    return _placed(origin, unit(edge - origin), generator, precision)


def around(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from `distance` m at points in a cube of half-size 0.7."""
    target = generator.uniform(-0.7, 0.7, (count, 3))
    origin = rounded(target + directions(count, generator) * distance, precision)
    return {"o": origin, "d": rounded(unit(target - origin), precision)}


def in_face(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays inside a face's plane with the component along its normal +0 (1) or -0 (2), aimed at the face."""
    o = np.stack([np.full(count, 0.5), np.full(count, -2.0), generator.uniform(-0.4, 0.4, count)], axis=1)
    d = np.stack([np.zeros(count), np.ones(count), generator.uniform(-0.05, 0.05, count)], axis=1)
    drawn = _placed(o, d, generator, precision)
    drawn["d"][drawn["d"] == 0] = 0.0 if kind == 1 else -0.0
    return drawn


def along_edge(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays along an edge's line, with zeros +0 (1) or -0 (2), from outside (of either end) or from within it."""
    start = np.where(generator.random(count) < 0.5, -2.0, generator.uniform(-0.4, 0.4, count))
    o = np.stack([np.full(count, 0.5), np.full(count, 0.5), start], axis=1)
    d = np.tile([0.0, 0.0, 1.0], (count, 1))
    drawn = _placed(o, d, generator, precision)
    drawn["d"][drawn["d"] == 0] = 0.0 if kind == 1 else -0.0
    return drawn


def through_corner(steps: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays exactly through a corner, by sums of powers of two, which are exact: they touch or enter the cube."""
    corner = np.full((count, 3), 0.5)
    d = generator.integers(1, 8, (count, 3)) / 8.0 * np.where(generator.random((count, 3)) < 0.5, -1.0, 1.0)
    return _placed(corner - d * steps, d, generator, precision)


def inside(depth: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays in all directions from `depth` m below a face; 0 is on the face itself."""
    o = np.concatenate([np.full((count, 1), 0.5 - depth), generator.uniform(-0.45, 0.45, (count, 2))], axis=1)
    return _placed(o, directions(count, generator), generator, precision)


def leaving(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that leave the cube behind them at `distance` m: every one misses."""
    drawn = around(2.0 + distance, count, generator, precision)
    return drawn | {"d": -drawn["d"]}


def nearly_parallel(slope: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that cross the cube with one component of the direction about `slope`."""
    o = np.concatenate(
        [generator.uniform(-0.7, 0.7, (count, 1)), np.full((count, 1), -3.0), generator.uniform(-0.2, 0.2, (count, 1))],
        axis=1,
    )
    d = np.stack(
        [slope * generator.uniform(0.5, 1, count), np.ones(count), generator.uniform(-0.05, 0.05, count)], axis=1
    )
    return _placed(o, d, generator, precision)


def plate(thickness: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return, in its object space, rays at a plate of this thickness: one axis is stretched by 1 / thickness."""
    target = generator.uniform(-0.6, 0.6, (count, 3)) * [1, 1, thickness]
    away = directions(count, generator)
    away[:, 2] = np.sign(away[:, 2]) * (abs(away[:, 2]) + 0.1)
    origin = target + unit(away) * 3
    stretch = np.array([1, 1, 1 / thickness])
    return {"o": rounded(origin * stretch, precision), "d": rounded((target - origin) / 3 * stretch, precision)}


def beside_edge(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from 5 m at a face, `margin` m from one of its edges."""
    return _beside(margin, 5.0, count, generator, precision)


def beside_edge_far(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from `distance` m at a face, 1e-6 m (float64: 2e-15 m) from one of its edges."""
    return _beside(1e-6 if precision == "float32" else 2e-15, distance, count, generator, precision)


def _beside(margin: float, distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    hit = np.stack(
        [np.full(count, 0.5), 0.5 - margin * generator.uniform(0.5, 1.5, count), generator.uniform(-0.45, 0.45, count)],
        axis=1,
    )
    away = unit(np.stack([np.ones(count), *(abs(generator.normal(size=(2, count)))) * 0.6], axis=1))
    origin = rounded(hit + away * distance, precision)
    return _placed(origin, unit(hit - origin), generator, precision)


# The ladders.
K_BOX = "(|o_i| + 0.5 + |t d_i|) / (|d_i| |t|) on the axis that decides"
NO_K = "none: right or wrong"
RIGHT = ("slabs", "parallel_branch")


def _ladder(**about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "box",
        "question": "distance",
        "slots": ("cube",),
        "condition": K_BOX,
        "unit": "u t",
    }
    return Ladder(**(fields | about), saturated=float("inf"), options={"shape": "cube"})


def _count(**about: Any) -> Ladder:
    last = about["values"][-1]
    gate: Any = Gate(reaches={"float32": last, "float64": last}, misclassified=0.0, index=float("inf"))
    return _ladder(kind="count", **({"gate": gate} | about))


DIVIDED = Failure(
    formulas=("divides_anyway", "division", "ieee_slabs", "ize", "nan_dropping"),
    because="0 / 0 or 0 times infinity in the plane of a face",
)
LADDERS = (
    _ladder(
        name="BOX-FAR",
        parameter="distance of the eye [m]",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=around,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e6}),
        first_to_break="all alike",
        survivor="all: one subtraction per plane",
    ),
    _count(
        name="BOX-FACE",
        parameter="rays in a face's plane, direction along the normal +0 (1) or -0 (2)",
        values=(1.0, 2.0),
        draw=in_face,
        fails=(DIVIDED,),
        first_to_break="cube/ieee_slabs, nan_dropping, ize, division",
        survivor="cube/slabs, parallel_branch",
    ),
    _count(
        name="BOX-EDGE",
        parameter="rays along an edge, zeros +0 (1) or -0 (2)",
        values=(1.0, 2.0),
        draw=along_edge,
        fails=(DIVIDED,),
        first_to_break="cube/ieee_slabs, nan_dropping, ize, division",
        survivor="cube/slabs, parallel_branch",
    ),
    _count(
        name="BOX-CORNER",
        parameter="steps from an eye exactly in line with a corner",
        values=(1.0, 2.0, 8.0, 64.0, 1024.0),
        draw=through_corner,
        first_to_break="none measured: equal quotients round alike, so that exact ties stay ties",
        survivor="all",
    ),
    _ladder(
        name="BOX-SIL",
        parameter="distance of the eye [m], aimed at an edge of the outline",
        values=(5.0, 1e1, 1e2, 1e3, 1e4),
        draw=silhouette,
        rays=4000,
        kind="count",
        gate=Gate(reaches={"float32": 1e4, "float64": 1e4}, misclassified=0.01),
        fails=(
            Failure(
                formulas=("*",),
                because="rounding makes ties at the silhouette, and ties are hits: a third to half of all rays",
            ),
        ),
        first_to_break="cube/ieee_slabs, ize",
        survivor="float64 on float32 inputs alone",
    ),
    _ladder(
        name="BOX-PLATE",
        parameter="thickness of a plate [m]",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=plate,
        rays=2000,
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-8}),
        first_to_break="none measured",
        survivor="all",
        measured="predicted: enter > leave by rounding on thin plates. In object space the plate is a cube and the "
        "stretched direction keeps the order of its slabs: no miss down to 1e-8",
    ),
    _ladder(
        name="BOX-SLANT",
        parameter="smallest component of the direction",
        values=(1e-1, 1e-3, 1e-6, 1e-12, 1e-20, 1e-30, 1e-38),
        draw=nearly_parallel,
        gate=Gate(reaches={"float32": 1e-38, "float64": 1e-38}),
        first_to_break="a form that treats a small component as zero, or overflows",
        survivor="all",
    ),
    _ladder(
        name="BOX-IN",
        parameter="depth below a face [m]; 0 on it",
        values=(0.5, 0.1, 1e-2, 1e-4, 1e-6, 0.0),
        draw=inside,
        gate=Gate(reaches={"float32": 0.0, "float64": 0.0}),
        fails=(
            Failure(formulas=("entry_only",), because="erratum E4: the entry lies behind"),
            Failure(formulas=("ize",), because="t_far is stretched by 2 gamma(3) on purpose"),
        ),
        first_to_break="cube/entry_only",
        survivor="all others",
    ),
    _count(
        name="BOX-BEHIND",
        parameter="distance of a box behind the ray [m]",
        values=(1.0, 1e2, 1e4),
        draw=leaving,
        fails=(Failure(formulas=("entry_only",), because="erratum E4: the entry lies behind"),),
        first_to_break="a form without an interval",
        survivor="all",
    ),
    _ladder(
        name="BOX-NORM",
        question="face",
        slots=("cube_normal",),
        parameter="distance of the hit from an edge [m], eye at 5 m",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
        draw=beside_edge,
        kind="count",
        unit="wrong faces",
        condition=NO_K,
        rays=2000,
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-7}),
        first_to_break="cube_normal/greatest",
        survivor="cube_normal/entering_slab",
    ),
    _ladder(
        name="BOX-NORM-FAR",
        question="face",
        slots=("cube_normal",),
        parameter="distance of the eye [m], hits 1e-6 m (float64: 1e-15 m) from an edge",
        values=(5.0, 3e1, 1e2, 1e3, 1e4),
        draw=beside_edge_far,
        kind="count",
        unit="wrong faces",
        condition=NO_K,
        rays=2000,
        gate=Gate(reaches={"float32": 5.0, "float64": 5.0}),
        first_to_break="cube_normal/greatest",
        survivor="cube_normal/entering_slab",
        measured="predicted: 7 to 10 % wrong faces by greatest and 1 to 3 % by entering_slab; on the unit cube "
        "greatest is the better one, 18 % to 22 % at 100 m and 18 % to 41 % at 10 km",
    ),
)
