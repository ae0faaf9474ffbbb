"""Ladders of rays at inner edges and vertices of sheets of triangles, which may neither leak nor hit twice."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, across, rounded
from rayproof.cases.placement import unit

# Draws. Rays at the inner edges and vertices of a jittered sheet.
SHEET = 33  # vertices along a side of the jittered sheet


def sheet(fan: str, *, scaled_by_value: bool) -> Draw:
    """Return a draw of rays at inner edges or vertices of a jittered sheet, its value a translation or a scale."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        offset, scale = (0.0, value) if scaled_by_value else (value, 1.0)
        return _drawn(fan, offset, scale, count, generator, precision)

    return draw


def _drawn(fan: str, offset: float, scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    # Fewer, larger cells far from the origin: a cell must be many float spacings wide.
    rows, columns = np.meshgrid(np.arange(SHEET), np.arange(SHEET), indexing="ij")
    vertices = np.stack([rows, columns, np.zeros_like(rows)], axis=-1) + generator.uniform(
        -0.25, 0.25, (SHEET, SHEET, 3)
    )
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    vertices = rounded((vertices @ turn + offset * np.array([0.6, -0.48, 0.64])) * scale, precision)
    if fan == "edge":
        i, j = generator.integers(1, SHEET - 2, (2, count))
        steps = np.array(
            [[(0, 0), (1, 1), (0, 1), (1, 0)], [(0, 0), (0, 1), (-1, 0), (1, 1)], [(0, 0), (1, 0), (1, 1), (0, -1)]]
        )
        step = steps[generator.integers(3, size=count)]
        corners = [vertices[i + step[:, k, 0], j + step[:, k, 1]] for k in range(4)]
        share = generator.uniform(0.05, 0.95, (count, 1))
        target = corners[0] * (1 - share) + corners[1] * share
    else:
        i, j = generator.integers(1, SHEET - 1, (2, count))
        ring = ((0, 0), (0, 1), (1, 1), (1, 0), (0, -1), (-1, -1), (-1, 0))
        corners = [vertices[i + a, j + b] for a, b in ring]
        target = corners[0]
    normal = turn[2]
    direction = -normal * generator.uniform(0.5, 1.0, (count, 1)) + across(np.tile(normal, (count, 1)), generator) * 0.7
    origin = rounded(target - direction * 20 * scale, precision)
    aimed = rounded(unit(target - origin), precision)
    return {"o": origin, "d": aimed} | {f"p{k}": corner for k, corner in enumerate(corners)}


# The ladders.
LEAKING = (
    "moeller_trumbore",
    "moeller_trumbore_epsilon",
    "scalar_triple",
    "baldwin_weber",
    "signed_areas",
    "unsigned_areas",
)
UNSHARED = "two neighbours round their common edge differently"


def _sheet(fan: str, by_scale: bool, **about: Any) -> Ladder:
    return Ladder(
        group="triangle, square, plane",
        question="watertight",
        slots=("triangle",),
        draw=sheet(fan, scaled_by_value=by_scale),
        options={"fan": fan},
        unit="leaks and double hits per 10^6 rays",
        condition="none: right or wrong",
        kind="count",
        rays=250_000,
        quick_rays=20_000,
        first_to_break="triangle/unsigned_areas, baldwin_weber, moeller_trumbore",
        survivor="triangle/woop, woop_kahan, woop_float64_fallback",
        **about,
    )


def _none(*values: float) -> Gate:
    """Return the gate of no leak at all up to the last value: below 3 in 10^6 with 95 % by the rule of three."""
    return Gate(reaches={"float32": values[-1], "float64": values[-1]}, misclassified=0.0)


LADDERS = (
    _sheet(
        "edge",
        False,
        name="TRI-EDGE",
        parameter="distance of the sheet from the world's origin [cells]; rays at inner edges",
        values=(0.0, 1e1, 1e3, 1e5),
        gate=_none(1e5),
        fails=(Failure(formulas=LEAKING, because=UNSHARED),),
        measured="predicted: 69 000 leaks per million for moeller_trumbore, 164 000 measured. Dr.Jit fuses "
        "products in dot and cross; the same rays in NumPy, unfused, leak 92 000, and 92 000 to 207 000"
        " by which corner comes first",
    ),
    _sheet(
        "edge",
        True,
        name="TRI-EDGE-SCALE",
        parameter="size of the cells [m]; rays at inner edges",
        values=(1.0, 1e3, 1e6, 1e-3, 1e-6),
        gate=_none(1e-6),
        fails=(
            Failure(formulas=LEAKING, because=UNSHARED),
            Failure(
                formulas=("printed_third_row",),
                because="at 1e-6 m its mixed terms are lost; elsewhere it hits both neighbours",
                precisions=("float32",),
            ),
        ),
    ),
    _sheet(
        "vertex",
        False,
        name="TRI-VERT",
        parameter="distance of the sheet from the world's origin [cells]; rays at inner vertices",
        values=(0.0, 1e1, 1e3, 1e5),
        gate=_none(1e5),
        fails=(Failure(formulas=(*LEAKING, "pluecker", "printed_third_row"), because=UNSHARED),),
        measured="predicted: 51 000 leaks per million for moeller_trumbore and 1 683 for pluecker, 186 000 and "
        "17 700 measured, for the reason given at TRI-EDGE",
    ),
    _sheet(
        "vertex",
        True,
        name="TRI-VERT-SCALE",
        parameter="size of the cells [m]; rays at inner vertices",
        values=(1.0, 1e6, 1e-6),
        gate=_none(1e-6),
        fails=(Failure(formulas=(*LEAKING, "pluecker", "printed_third_row"), because=UNSHARED),),
    ),
)
