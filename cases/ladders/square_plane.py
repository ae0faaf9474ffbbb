"""Ladders of ray and plane, and ray and square."""

from typing import Any

from rayproof.cases.ladders.draws import matrices
from rayproof.cases.ladders.draws import triangle as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

TWICE_THE_SIZE = Failure(formulas=("full_vectors",), because="erratum E7: twice the size")


def _ladder(shape: str, **about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "triangle, square, plane",
        "question": "distance",
        "slots": (shape,),
        "condition": "(|o.z| + |t d.z|) / (|d.z| |t|) = 2",
        "unit": "u t",
        "saturated": float("inf"),
        "options": {"shape": shape, "natural": "roundings"},
    }
    return Ladder(**(given | about))


LADDERS = (
    _ladder(
        "plane",
        name="PLN-GRAZE",
        parameter="cosine of incidence",
        values=(1.0, 0.5, 0.1, 1e-2, 1e-4, 1e-6, 1e-8),
        draw=draws.plane_grazing,
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-8}),
        first_to_break="none: in object space the normal is exact",
        survivor="all",
        laws=(Law(formulas=("*",), slope=0.0, because="-o.z / d.z is one division of exact numbers"),),
    ),
    _ladder(
        "plane",
        name="PLN-FAR",
        parameter="distance of the eye [m]",
        values=(1.0, 1e3, 1e6, 1e9, 1e18, 1e30),
        draw=draws.plane_far,
        gate=Gate(reaches={"float32": 1e30, "float64": 1e30}),
        first_to_break="none",
        survivor="all",
        laws=(Law(formulas=("*",), slope=0.0, because="-o.z / d.z is one division of exact numbers"),),
    ),
    _ladder(
        "plane",
        name="PLN-PAR",
        parameter="rays along the plane: 1 above it, 2 in it, 3 in it from z = -0",
        values=(1.0, 2.0, 3.0),
        draw=draws.plane_parallel,
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
        draw=draws.border,
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
        draw=matrices.rays(matrices.stretched, reach=0.9, flat=True),
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
        draw=matrices.rays(matrices.sheared, reach=0.9, flat=True),
        condition="K_local of the plane z = 0 in exact object space",
        gate=Gate(reaches={"float32": 1e1, "float64": 1e3}, index=float("inf")),
        fails=(TWICE_THE_SIZE,),
        first_to_break="square/full_vectors; vectors without a Gram matrix",
        survivor="square/local, half_vectors",
    ),
)
