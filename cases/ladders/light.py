"""Ladders of light: irradiance, cosine, sums of lights, exitance, radiance, and which side faces the viewer."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, PredictedSlope, across, directions, rounded
from rayproof.cases.ladders.transforms import edge_on
from rayproof.cases.placement import unit


# Draws. Ways to lights.
def slanted(normal: np.ndarray, cosine: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return random unit vectors at these cosines to unit normals."""
    c = cosine[:, None]
    return c * normal + np.sqrt(1 - c * c) * across(normal, generator)


def ways(*, flux: float = 100.0, length: float = 1.0, swept: str = "length", narrow: bool = False) -> Draw:
    """Return a draw of ways to a light in all directions above random unit normals, and a flux; one is `swept`.

    Swept "cosine": dot(N, L) is about the value.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"flux": flux, "length": length, "cosine": 0.0} | {swept: value}
        normal = rounded(directions(count, generator), precision)
        cosine = np.full(count, now["cosine"]) if now["cosine"] else generator.uniform(0.1, 1, count)
        away = slanted(unit(normal), cosine, generator) * generator.uniform(1.0, 1.9, (count, 1))
        with np.errstate(over="ignore"):
            away = away * now["length"]
        return {
            "flux": np.full(count, rounded(np.array(now["flux"]), precision)),
            "normal": normal,
            "away": rounded(away, precision),
        }

    return draw


def dark(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return lights 1 exactly at the point, 2 behind the surface, 3 along it with n . L = +0 or -0."""
    normal = rounded(directions(count, generator), precision)
    away = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    if kind == 2:
        away = -normal * generator.uniform(0.5, 2, (count, 1))
    if kind == 3:
        # Swapped components with a changed sign, of so few digits that their products are exact: a right angle.
        normal = generator.integers(1, 9, (count, 3)) / 8.0
        normal[:, 2] = np.where(generator.random(count) < 0.5, -0.0, 0.0)
        away = np.stack([-normal[:, 1], normal[:, 0], generator.normal(size=count)], axis=1)
    return {"flux": np.full(count, 100.0), "normal": normal, "away": rounded(away, precision)}


# Contributions of lights, albedos and exitances.
MOST = 64  # lights


def _lights(parts: np.ndarray, precision: str) -> Inputs:
    return {f"light{k}": column for k, column in enumerate(rounded(parts, precision).T)}


def of_all_sizes(spread: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return eight contributions whose sizes are spread evenly over a range of `spread`, in any order."""
    sizes = spread ** (generator.permuted(np.tile(np.linspace(-0.5, 0.5, 8), (count, 1)), axis=1))
    return _lights(sizes * generator.uniform(0.5, 1, (count, 8)), precision)


def many(lights: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return `lights` contributions of about one size, and nothing from the others of MOST."""
    parts = generator.uniform(0.5, 1, (count, MOST))
    parts[:, int(lights) :] = 0
    return _lights(parts, precision)


def leaving(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return albedos, and irradiances of about `size`, in three channels."""
    albedo, irradiance = generator.uniform(0.01, 1, (2, count, 3))
    return {"albedo": rounded(albedo, precision), "irradiance": rounded(irradiance * size, precision)}


def exitances(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return exitances of about `size`."""
    return {"exitance": rounded(generator.uniform(0.1, 1, count) * size, precision)}


# Ladders of irradiance and of the cosine.
ULPS = "1: error / ulp of the result"


def _light(slot: str, **about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "light and shadow",
        "question": "light",
        "slots": (slot,),
        "unit": "ulp",
        "condition": ULPS,
        "saturated": float("inf"),
        "rays": 200,
        "quick_rays": 60,
    }
    return Ladder(**(fields | about))


ONE_LIGHT = (
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
        slopes=(
            PredictedSlope(
                formulas=("inverse_square", "scaled"), slope=0.0, because="four roundings at every distance"
            ),
        ),
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
                formulas=("inverse_square", "scaled"),
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
        slopes=(PredictedSlope(formulas=("direct", "scaled"), slope=0.0, because="the absolute error is a few u"),),
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


# Ladders of the steps after one light: the sum of lights, exitance and radiance, and the visible side of a surface.
SIZES = (1.0, 1e6, 1e12, 1e24, 1e36, 1e-6, 1e-12, 1e-24, 1e-33)


def _ladder(slot: str, *, slope: float | None, because: str, **about: Any) -> Ladder:
    last = about["values"][-1]
    fields: dict[str, Any] = {
        "group": "light and shadow",
        "question": "value",
        "slots": (slot,),
        "unit": "roundings",
        "condition": "sum of |x df/dx| over the inputs x, over the value: at most 2, and nothing cancels",
        "saturated": float("inf"),
        "options": {"natural": "roundings"},
        "gate": Gate(reaches={"float32": last, "float64": last}),
        "slopes": () if slope is None else (PredictedSlope(formulas=("*",), slope=slope, because=because),),
        "first_to_break": "none: no input is negative",
        "survivor": "all",
    }
    return Ladder(**(fields | about))


def _side(slot: str, **about: Any) -> Ladder:
    return Ladder(
        group="light and shadow",
        question="decision",
        slots=(slot,),
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=edge_on,
        kind="count",
        unit="surfaces on the wrong side",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-8}),
        first_to_break="the sign of a dot product at u",
        survivor="float64",
        **about,
    )


SUMS = (
    _ladder(
        "sum_lights",
        slope=0.0,
        because="n - 1 roundings of a sum of nothing negative, whatever the order: gamma(7) for eight lights",
        name="LGT-RANGE",
        parameter="largest over smallest of eight contributions",
        values=(1.0, 1e2, 1e4, 1e8, 1e12, 1e16, 1e20, 1e24),
        draw=of_all_sizes,
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
        draw=many,
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
        draw=leaving,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=1.0),
    ),
    _ladder(
        "radiance",
        slope=0.0,
        because="pi is rounded once, and the quotient",
        name="RAD-RANGE",
        parameter="exitance [W/m^2], smallest last",
        values=SIZES,
        draw=exitances,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=2.0),
    ),
    _ladder(
        "radiance_simplified",
        slope=0.0,
        because="nothing is computed",
        name="RAD-SIMPLIFIED",
        parameter="exitance [W/m^2], smallest last",
        values=SIZES,
        draw=exitances,
        gate=Gate(reaches={"float32": 1e-33, "float64": 1e-33}, index=0.0),
    ),
    _side("hidden", name="HID-EDGE", parameter="|cosine| between a one-sided surface's normal and the view"),
    _side("horizon", name="HOR-EDGE", parameter="|cosine| between normal and light, by the default formula"),
)

LADDERS = (*ONE_LIGHT, *SUMS)
