"""Ladders of ray and triangle."""

from typing import Any

from cases.ladders.draws import triangle as draws
from cases.ladders.ladder import Failure, Gate, Ladder, Law

MISPRINTS = ("printed_third_row", "unsigned_areas")
MISPRINTED = Failure(formulas=MISPRINTS, because="erratum E6 or E5: another condition than the triangle's")
NO_AREA = "what has no area may be hit by rounding; the tracer leaves such triangles out beforehand"


def _ladder(**about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "triangle, square, plane",
        "question": "distance",
        "slots": ("triangle",),
        "condition": "|n| . (|o - a| + |t d|) / (|n . d| |t|): the first corner is the origin",
        "unit": "u t",
        "saturated": float("inf"),
        "options": {"shape": "triangle", "natural": "roundings"},
    }
    return Ladder(**(given | about))


LADDERS = (
    _ladder(
        name="TRI-SLIV",
        parameter="aspect: base / height",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=draws.slivers,
        rays=2000,
        gate=Gate(reaches={"float32": 1e2, "float64": 1e2}, index=10.0),
        fails=(
            Failure(
                formulas=("moeller_trumbore", "moeller_trumbore_epsilon", "scalar_triple"),
                because="t is divided by a determinant that shrinks with the height",
            ),
            MISPRINTED,
        ),
        first_to_break="triangle/unsigned_areas, baldwin_weber, moeller_trumbore_epsilon",
        survivor="triangle/woop for t; misclassification is alike",
        measured="predicted: woop 200 times more accurate than moeller_trumbore at aspect 1e6, 220 times "
        "measured; woop_kahan has no slope at all (0.8 u at every aspect)",
        laws=(Law(formulas=("moeller_trumbore",), slope=1.0, because="the determinant shrinks with the height"),),
    ),
    _ladder(
        name="TRI-DEG",
        parameter="1 all corners equal, 2 two equal, 3 collinear, 4 no direction",
        values=(1.0, 2.0, 3.0, 4.0),
        draw=draws.degenerate,
        kind="count",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 4.0, "float64": 4.0}, misclassified=0.0),
        fails=(
            Failure(
                formulas=(
                    "woop",
                    "woop_kahan",
                    "woop_float64_fallback",
                    "pluecker",
                    "moeller_trumbore",
                    "printed_third_row",
                    "scalar_triple",
                ),
                because=NO_AREA,
            ),
            Failure(
                formulas=("moeller_trumbore_epsilon",),
                because=NO_AREA,
                precisions=("float32",),
            ),
        ),
        first_to_break="a form that divides by the determinant unguarded",
        survivor="a guarded form; none may hit what has no area",
    ),
    _ladder(
        name="TRI-GRAZE",
        parameter="cosine of incidence",
        values=(1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=draws.grazing,
        gate=Gate(reaches={"float32": 1e-2, "float64": 1e-5}, index=10.0),
        fails=(MISPRINTED,),
        first_to_break="all alike",
        survivor="float64",
        laws=(Law(formulas=("*",), slope=-1.0, because="K is 1 / cos"),),
    ),
    _ladder(
        name="TRI-ORG",
        parameter="distance of triangle and eye from the world's origin [m]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=draws.translated,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e5}),
        fails=(
            MISPRINTED,
            Failure(formulas=("baldwin_weber",), because="its matrix holds the translation"),
        ),
        first_to_break="triangle/baldwin_weber, whose matrix holds the translation",
        survivor="every form that subtracts a corner first",
    ),
    _ladder(
        name="TRI-FAR",
        parameter="distance of the eye from a unit triangle [m]",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.well_shaped,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e6}),
        fails=(MISPRINTED,),
        first_to_break="all: barycentrics lose u D",
        survivor="float64",
    ),
    _ladder(
        name="TRI-LARGE",
        parameter="uniform scale [m]",
        values=(1.0, 1e3, 1e6, 1e9, 1e12, 1e15),
        draw=draws.scaled,
        gate=Gate(reaches={"float32": 1e6, "float64": 1e15}),
        fails=(MISPRINTED,),
        first_to_break="forms with products of six lengths",
        survivor="triangle/woop",
    ),
    _ladder(
        name="TRI-TINY",
        parameter="uniform scale [m]",
        values=(1.0, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 1e-15),
        draw=draws.scaled,
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-15}),
        fails=(
            MISPRINTED,
            Failure(
                formulas=("moeller_trumbore_epsilon",), because="an absolute epsilon on an area deletes small triangles"
            ),
        ),
        first_to_break="triangle/moeller_trumbore_epsilon: a determinant is an area, not a number",
        survivor="triangle/moeller_trumbore, woop",
    ),
)
