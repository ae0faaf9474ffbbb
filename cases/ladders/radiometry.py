"""Ladders of what follows one light: their sum, exitance and radiance, and which side of a surface is meant."""

from typing import Any

from rayproof.cases.ladders.draws import radiometry as draws
from rayproof.cases.ladders.draws import special
from rayproof.cases.ladders.ladder import Gate, Ladder, Law

SIZES = (1.0, 1e6, 1e12, 1e24, 1e36, 1e-6, 1e-12, 1e-24, 1e-33)


def _ladder(slot: str, *, slope: float | None, because: str, **about: Any) -> Ladder:
    last = about["values"][-1]
    given: dict[str, Any] = {
        "group": "light and shadow",
        "question": "value",
        "slots": (slot,),
        "unit": "roundings",
        "condition": "sum of |x df/dx| over the inputs x, over the value: at most 2, and nothing cancels",
        "saturated": float("inf"),
        "options": {"natural": "roundings"},
        "gate": Gate(reaches={"float32": last, "float64": last}),
        "laws": () if slope is None else (Law(formulas=("*",), slope=slope, because=because),),
        "first_to_break": "none: no input is negative",
        "survivor": "all",
    }
    return Ladder(**(given | about))


def _side(slot: str, **about: Any) -> Ladder:
    return Ladder(
        group="light and shadow",
        question="decision",
        slots=(slot,),
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=special.edge_on,
        kind="count",
        unit="surfaces on the wrong side",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-8}),
        first_to_break="the sign of a dot product at u",
        survivor="float64",
        **about,
    )


LADDERS = (
    _ladder(
        "sum_lights",
        slope=0.0,
        because="n - 1 roundings of a sum of nothing negative, whatever the order: gamma(7) for eight lights",
        name="LGT-RANGE",
        parameter="largest over smallest of eight contributions",
        values=(1.0, 1e2, 1e4, 1e8, 1e12, 1e16, 1e20, 1e24),
        draw=draws.of_all_sizes,
        gate=Gate(reaches={"float32": 1e24, "float64": 1e24}, index=7.0),
        first_to_break="none: what is too small to be added is smaller than a rounding",
    ),
    _ladder(
        "sum_lights",
        slope=0.5,
        because="roundings of either sign add up like a random walk, far below gamma(n - 1)",
        name="LGT-MANY",
        parameter="lights of about one size",
        values=(2.0, 4.0, 8.0, 16.0, 32.0, 64.0),
        draw=draws.many,
        gate=Gate(reaches={"float32": 64.0, "float64": 64.0}, index=63.0),
        first_to_break="none up to 64 lights; then sums in one go, before sums by halves",
    ),
    _ladder(
        "exitance",
        slope=0.0,
        because="one product rounds once",
        name="EXI-RANGE",
        parameter="irradiance [W/m^2], smallest last",
        values=SIZES,
        draw=draws.leaving,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=1.0),
    ),
    _ladder(
        "radiance",
        slope=0.0,
        because="pi is rounded once, and the quotient",
        name="RAD-RANGE",
        parameter="exitance [W/m^2], smallest last",
        values=SIZES,
        draw=draws.exitances,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=2.0),
    ),
    _ladder(
        "radiance_simplified",
        slope=0.0,
        because="nothing is computed",
        name="RAD-SIMPLIFIED",
        parameter="exitance [W/m^2], smallest last",
        values=SIZES,
        draw=draws.exitances,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=0.0),
    ),
    _side("hidden", name="HID-EDGE", parameter="|cosine| between a one-sided surface's normal and the view"),
    _side("horizon", name="HOR-EDGE", parameter="|cosine| between normal and light, by the default formula"),
)
