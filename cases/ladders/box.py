"""Ladders of ray and box, and of the box's normal."""

from typing import Any

from rayproof.cases.ladders.draws import box as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder

K_BOX = "(|o_i| + 0.5 + |t d_i|) / (|d_i| |t|) on the axis that decides"
NO_K = "none: right or wrong"
RIGHT = ("slabs", "parallel_branch")


def _ladder(**about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "box",
        "question": "distance",
        "slots": ("cube",),
        "condition": K_BOX,
        "unit": "u t",
    }
    return Ladder(**(given | about), saturated=float("inf"), options={"shape": "cube"})


def _count(**about: Any) -> Ladder:
    last = about["values"][-1]
    gate: Any = Gate(reaches={"float32": last, "float64": last}, misclassified=0.0, index=float("inf"))
    return _ladder(kind="count", **({"gate": gate} | about))


LADDERS = (
    _ladder(
        name="BOX-FAR",
        parameter="distance of the eye [m]",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.around,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e6}),
        first_to_break="all alike",
        survivor="all: one subtraction per plane",
    ),
    _count(
        name="BOX-FACE",
        parameter="rays in a face's plane, direction along the normal +0 (1) or -0 (2)",
        values=(1.0, 2.0),
        draw=draws.in_face,
        fails=(
            Failure(
                formulas=(
                    "divides_anyway",
                    "division",
                    "ieee_slabs",
                    "ize",
                    "nan_dropping",
                ),
                because="0 / 0 or 0 times infinity in the plane of a face",
            ),
        ),
        first_to_break="cube/ieee_slabs, nan_dropping, ize, division",
        survivor="cube/slabs, parallel_branch",
    ),
    _count(
        name="BOX-EDGE",
        parameter="rays along an edge, zeros +0 (1) or -0 (2)",
        values=(1.0, 2.0),
        draw=draws.along_edge,
        fails=(
            Failure(
                formulas=(
                    "divides_anyway",
                    "division",
                    "ieee_slabs",
                    "ize",
                    "nan_dropping",
                ),
                because="0 / 0 or 0 times infinity in the plane of a face",
            ),
        ),
        first_to_break="cube/ieee_slabs, nan_dropping, ize, division",
        survivor="cube/slabs, parallel_branch",
    ),
    _count(
        name="BOX-CORNER",
        parameter="steps from an eye exactly in line with a corner",
        values=(1.0, 2.0, 8.0, 64.0, 1024.0),
        draw=draws.through_corner,
        first_to_break="none measured: equal quotients round alike, so that exact ties stay ties",
        survivor="all",
    ),
    _ladder(
        name="BOX-SIL",
        parameter="distance of the eye [m], aimed at an edge of the outline",
        values=(5.0, 1e1, 1e2, 1e3, 1e4),
        draw=draws.silhouette,
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
        draw=draws.plate,
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
        draw=draws.nearly_parallel,
        gate=Gate(reaches={"float32": 1e-38, "float64": 1e-38}),
        first_to_break="a form that treats a small component as zero, or overflows",
        survivor="all",
    ),
    _ladder(
        name="BOX-IN",
        parameter="depth below a face [m]; 0 on it",
        values=(0.5, 0.1, 1e-2, 1e-4, 1e-6, 0.0),
        draw=draws.inside,
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
        draw=draws.leaving,
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
        draw=draws.beside_edge,
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
        draw=draws.beside_edge_far,
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
