"""Ladders of ray and triangle."""

from typing import Any

from rayproof.cases.ladders.draws import matrices
from rayproof.cases.ladders.draws import triangle as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

MISPRINTS = ("printed_third_row", "unsigned_areas")
RIGHT = (
    "moeller_trumbore",
    "moeller_trumbore_epsilon",
    "scalar_triple",
    "signed_areas",
    "baldwin_weber",
    "pluecker",
    "woop",
    "woop_kahan",
    "woop_float64_fallback",
)
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


def _tree(bundle: int = 1, **about: Any) -> Ladder:
    last = about["values"][-1]
    return Ladder(
        group="box",
        question="tree",
        slots=("triangle",),
        only=("woop_kahan",),
        unit="triangles lost",
        condition="none: met or lost",
        kind="count",
        rays=1024,
        quick_rays=256,
        options={"shape": "triangle", "bundle": bundle},
        gate=Gate(reaches={"float32": last, "float64": last}, misclassified=0.0, index=float("inf")),
        first_to_break="slabs without room for their own roundings: the far end comes before the near one",
        survivor="beams in tracer/acceleration, moved outward by 16 u (Ize 2013: 2 gamma(3))",
        **about,
    )


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
        name="TRI-AROUND",
        parameter="distance at which rays pass a sliver in its plane, seen at 0.5 degrees [m]",
        values=(3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3),
        draw=draws.around,
        kind="count",
        unit="phantom hits",
        condition="none: all miss",
        rays=50_000,
        quick_rays=5_000,
        gate=Gate(reaches={"float32": 0.1, "float64": 1e-3}, misclassified=0.0, index=float("inf")),
        fails=(Failure(formulas=("printed_third_row",), because="erratum E6: another condition than the triangle's"),),
        first_to_break="triangle/moeller_trumbore and scalar_triple, whose t is off by up to 560 K u then",
        survivor="float64; triangle/woop, woop_kahan, signed_areas",
        measured="in float32 300 m away 16 u are 3e-4 m, in the plane 0.033 m; of 50 000 rays that pass by 1 cm"
        " moeller_trumbore hits with 309, scalar_triple with 86; by 3 mm with 2930 and 2211, baldwin_weber with 819,"
        " pluecker with 42, woop_kahan with 1",
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
    _ladder(
        name="TRI-SHORT",
        parameter="size of a triangle [m], seen from 3 m",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=draws.sized,
        gate=Gate(reaches={"float32": 1e-4, "float64": 1e-6}),
        fails=(
            MISPRINTED,
            Failure(
                formulas=("moeller_trumbore_epsilon",), because="an absolute epsilon on an area deletes small triangles"
            ),
        ),
        first_to_break="triangle/moeller_trumbore_epsilon, then all alike: barycentrics lose u D / size",
        survivor="all for t",
        laws=(Law(formulas=RIGHT, slope=0.0, because="t is that of the plane, which the corners give at any size"),),
    ),
    _ladder(
        name="TRI-LONG",
        parameter="size of a triangle [m], seen from 3 m",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=draws.sized,
        gate=Gate(reaches={"float32": 1e7, "float64": 1e7}, index=100.0),
        fails=(MISPRINTED,),
        first_to_break="triangle/woop, woop_kahan, pluecker: up to 28 K u",
        survivor="triangle/baldwin_weber in float32, whose matrix is made in float64",
        measured="predicted: 4 K u for all. The shear mixes the axes, so that t is off by the longest of them, where K"
        " counts what lies along the normal: 28 K u at most for woop_kahan, 9 for moeller_trumbore",
        laws=(
            Law(
                formulas=("baldwin_weber",), slope=0.0, because="its matrix is made in float64", precisions=("float32",)
            ),
            Law(formulas=RIGHT, slope=1.0, because="corners are left with u L beside the ray", skip=2),
        ),
    ),
    _ladder(
        name="TRI-BAKED",
        question="baked_distance",
        parameter="distance from the world's origin to which a mesh is moved [m]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=matrices.triangles(matrices.moved),
        condition="|n| . (|o| + |t d|) / (|n . d| |t|): the world's origin is the origin",
        gate=Gate(reaches={"float32": 1e5, "float64": 1e5}),
        fails=(MISPRINTED,),
        first_to_break="the baking, not a formula: corners are float32 in either precision",
        survivor="none; a ray taken into object space would not see the translation (XF-FAR)",
        laws=(Law(formulas=RIGHT, slope=1.0, because="a corner is left with u T, u that of float32", skip=2),),
    ),
    _ladder(
        name="TRI-ORDER",
        question="order",
        slots=("nearest", "triangle"),
        parameter="gap between two parallel triangles [m], seen from 3 m",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
        draw=draws.layers,
        kind="count",
        unit="surfaces in the wrong order",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-7}),
        fails=(MISPRINTED,),
        first_to_break="all alike, where the gap is a few roundings of t",
        survivor="float64; nearest/smaller compares exactly whatever it is given",
    ),
    _tree(
        name="TREE-FAR",
        parameter="distance of the eye [sheets]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=draws.tiles(far=True),
    ),
    _tree(
        name="TREE-FAR-BEAM",
        parameter="distance of the eye [sheets], four rays at once",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=draws.tiles(far=True),
        bundle=4,
    ),
    _tree(
        name="TREE-MOVED",
        parameter="distance from the world's origin [sheets]",
        values=(0.0, 1.0, 1e1, 1e2, 1e3),
        draw=draws.tiles(moved=True),
    ),
    _tree(
        name="TREE-GRAZE",
        parameter="cosine of incidence, along an axis",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=draws.tiles(grazing=True),
    ),
)
