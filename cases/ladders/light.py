"""Ladders of irradiance and of the cosine."""

from typing import Any

from rayproof.cases.ladders.draws.light import ways
from rayproof.cases.ladders.draws.special import dark
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

ULPS = "1: error / ulp of the result"


def _light(slot: str, **about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "light and shadow",
        "question": "light",
        "slots": (slot,),
        "unit": "ulp",
        "condition": ULPS,
        "saturated": float("inf"),
        "rays": 200,
        "quick_rays": 60,
    }
    return Ladder(**(given | about))


LADDERS = (
    _light(
        "falloff",
        name="LGT-NEAR",
        parameter="distance of the light [m]",
        values=(1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
        draw=ways(),
        gate=Gate(reaches={"float32": 1e-12, "float64": 1e-12}, index=8.0),
        fails=(Failure(formulas=("none",), because="erratum E9: no falloff"),),
        first_to_break="the data, not the formula: end to end u |p| / r",
        survivor="both",
        laws=(Law(formulas=("inverse_square", "scaled"), slope=0.0, because="four roundings at every distance"),),
    ),
    _light(
        "falloff",
        name="LGT-FAR",
        parameter="distance of the light [m]",
        values=(1.0, 1e4, 1e8, 1e12, 1e16, 1e18, 1e19, 1e20, 1e22),
        draw=ways(),
        gate=Gate(reaches={"float32": 1e22, "float64": 1e22}, index=8.0),
        fails=(
            Failure(formulas=("none",), because="erratum E9: no falloff"),
            Failure(formulas=("inverse_square",), because="r^2 overflows at 1.8e19", precisions=("float32",)),
            Failure(
                formulas=("scaled",),
                because="Dr.Jit flushes subnormals to zero, so that light that faint is none",
                precisions=("float32",),
            ),
        ),
        first_to_break="falloff/inverse_square: r^2 overflows at 1.8e19 in float32",
        survivor="falloff/scaled",
        measured="predicted: scaled right up to 1e20 as a subnormal. Dr.Jit's worker threads flush subnormals on"
        " LLVM too: nothing is left beyond 1e19",
    ),
    _light(
        "falloff",
        name="LGT-TINY",
        parameter="distance of the light [m]",
        values=(1e-12, 1e-16, 1e-17, 1e-18, 1e-19, 1e-20, 1e-22, 1e-24),
        draw=ways(flux=1e-6),
        gate=Gate(reaches={"float32": 1e-24, "float64": 1e-24}, index=8.0),
        fails=(
            Failure(formulas=("none",), because="erratum E9: no falloff"),
            Failure(
                formulas=("inverse_square",),
                because="r^2 is subnormal below 1e-19 and has few digits before",
                precisions=("float32",),
            ),
        ),
        first_to_break="falloff/inverse_square: r^2 is subnormal",
        survivor="falloff/scaled; beyond the largest float an infinity is right",
    ),
    _light(
        "falloff",
        name="LGT-PHI",
        parameter="flux [W], largest last",
        values=(1.0, 1e-10, 1e-20, 1e-30, 1e-38, 1e-44, 0.0, 1e10, 1e20, 1e30, 3e38),
        draw=ways(swept="flux"),
        gate=Gate(reaches={"float32": 3e38, "float64": 3e38}, index=8.0),
        fails=(
            Failure(formulas=("none",), because="erratum E9: no falloff"),
            Failure(
                formulas=(
                    "inverse_square",
                    "scaled",
                ),
                because="Dr.Jit flushes subnormals to zero, so that light that faint is none",
                precisions=("float32",),
            ),
        ),
        first_to_break="a form that divides by 4 pi r^2 in two steps loses subnormals to one rounding more",
        survivor="both",
    ),
    _light(
        "cosine",
        name="COS-TINY",
        parameter="distance of the light [m]",
        values=(1.0, 1e-8, 1e-16, 1e-18, 1e-20, 1e-22, 1e-24, 1e-30),
        draw=ways(),
        gate=Gate(reaches={"float32": 1e-30, "float64": 1e-30}, index=8.0),
        options={"natural": "absolute"},
        unit="u, absolute",
        fails=(Failure(formulas=("direct",), because="the squared distance is subnormal", precisions=("float32",)),),
        first_to_break="cosine/direct: |away|^2 is subnormal from 1e-20",
        survivor="cosine/scaled",
    ),
    _light(
        "cosine",
        name="COS-FAR",
        parameter="distance of the light [m]",
        values=(1.0, 1e8, 1e16, 1e18, 1e19, 1e20, 1e30),
        draw=ways(),
        gate=Gate(reaches={"float32": 1e30, "float64": 1e30}, index=8.0),
        options={"natural": "absolute"},
        unit="u, absolute",
        fails=(Failure(formulas=("direct",), because="the squared distance overflows", precisions=("float32",)),),
        first_to_break="cosine/direct: |away|^2 overflows",
        survivor="cosine/scaled",
    ),
    _light(
        "cosine",
        name="LAM-GRAZE",
        parameter="n . L",
        values=(1.0, 0.5, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
        draw=ways(swept="cosine"),
        gate=Gate(reaches={"float32": 1e-7, "float64": 1e-7}, index=8.0),
        options={"natural": "absolute"},
        unit="u, absolute",
        first_to_break="none: the absolute error is flat, and light is what counts",
        survivor="both",
        laws=(Law(formulas=("direct", "scaled"), slope=0.0, because="the absolute error is a few u"),),
    ),
    Ladder(
        name="LGT-DARK",
        group="light and shadow",
        question="dark_light",
        slots=("falloff", "cosine", "lambert"),
        parameter="light 1 exactly at the point, 2 behind the surface, 3 exactly along it",
        values=(1.0, 2.0, 3.0),
        draw=dark,
        unit="light where there is none, or NaN",
        condition="none: light or none",
        kind="count",
        gate=Gate(reaches={"float32": 3.0, "float64": 3.0}, misclassified=0.0),
        fails=(
            Failure(
                formulas=("cosine/scaled",), because="away / m is rounded: light of 1e-9 W/m^2 at an exact right angle"
            ),
        ),
        first_to_break="0 / 0 in L / |L|",
        survivor="cosine/direct, scaled: 0 by definition at the point",
    ),
)
