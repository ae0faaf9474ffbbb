"""Ladders of rays at the inner edges and vertices of sheets of triangles: none may leak, none should hit twice."""

from typing import Any

from rayproof.cases.ladders.draws import triangle as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder

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
        draw=draws.sheet(fan, scaled_by_value=by_scale),
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
