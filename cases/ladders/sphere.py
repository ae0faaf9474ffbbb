"""Ladders of ray and sphere."""

from typing import Any

from rayproof.cases.ladders.draws import sphere as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

# sphere/float64 solves the textbook's quadratic in float64: as good as any in float32, one of these in float64.
QUADRATICS = ("textbook", "half_b", "stable_quadratic", "kahan", "first_positive")
IN_FLOAT64 = (*QUADRATICS, "float64")
K_LOCAL = "(|n| . (|o - c| + |t d|) + r) / (|n . d| |t|): the sphere's centre is the origin"
HALF_DECADES = (*(float(f"{digit}e{decade}") for decade in range(1, 8) for digit in (1, 3)), 1e8)
SQUARED = "the discriminant is a difference of squares of the distance: u (D / r)^2"
CANCELLING = Failure(formulas=QUADRATICS, because="squares of the distance cancel: from 4 K u at D / r = 2 on")
TEXTBOOK = Failure(formulas=("float64",), because="in float64 it is the textbook form", precisions=("float64",))
LINEAR = "the closest point is off by u D, and nothing is squared before the subtraction"


def _ladder(**about: Any) -> Ladder:
    options = {"shape": "sphere", "natural": about.pop("natural", "roundings")}
    given: dict[str, Any] = {
        "group": "sphere",
        "question": "distance",
        "slots": ("sphere",),
        "condition": K_LOCAL,
        "unit": "u t",
    }
    return Ladder(**(given | about), options=options)


LADDERS = (
    _ladder(
        name="SPH-FAR",
        parameter="distance / radius",
        values=HALF_DECADES,
        draw=draws.far,
        unit="|dt| / r",
        natural="radii",
        rays=4000,
        quick_rays=1000,
        gate=Gate(reaches={"float32": 1e5, "float64": 1e8}),
        fails=(CANCELLING, TEXTBOOK),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift",
        laws=(
            Law(formulas=QUADRATICS, slope=1.97, because=SQUARED),
            Law(formulas=("float64",), slope=1.97, because=SQUARED, precisions=("float64",)),
            Law(formulas=("*",), slope=0.98, because=LINEAR),
        ),
    ),
    _ladder(
        name="SPH-SMALL",
        parameter="1 / radius [1/m], seen from 10 m",
        values=(1.0, 3.0, 1e1, 3e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=draws.far_small,
        unit="|dt| / r",
        natural="radii",
        gate=Gate(reaches={"float32": 1e4, "float64": 1e7}),
        fails=(CANCELLING, TEXTBOOK),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift",
        laws=(
            Law(formulas=("float64",), slope=1.0, because=LINEAR, precisions=("float32",)),
            Law(formulas=IN_FLOAT64, slope=1.97, because=SQUARED),
            Law(formulas=("*",), slope=0.98, because=LINEAR),
        ),
    ),
    _ladder(
        name="SPH-TAN",
        parameter="distance of the ray from the outline [r]",
        values=(1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7),
        draw=draws.tangent,
        rays=4000,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-7}),
        fails=(
            Failure(formulas=QUADRATICS, because="D is a difference of squares: 4 to 130 K u"),
            TEXTBOOK,
        ),
        first_to_break="sphere/textbook",
        survivor="sphere/haines, pbrt4, shift; no float32 form at 1e-7, which is u",
        laws=(
            Law(
                formulas=("float64",),
                slope=0.0,
                precisions=("float32",),
                because="one rounding, of the result, is left",
            ),
            Law(formulas=("*",), slope=-0.5, because="K is (2 delta)^(-1/2); the forms differ in the constant"),
        ),
    ),
    _ladder(
        name="SPH-NEAR",
        parameter="height above the surface [r]",
        values=(1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6),
        draw=draws.near,
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-6}),
        saturated=float("inf"),
        first_to_break="every float32 form alike",
        survivor="sphere/stable_quadratic in float64 on float32 inputs",
        laws=(
            Law(
                formulas=("float64",),
                slope=0.0,
                precisions=("float32",),
                because="squares of float32 numbers are exact in float64: Blinn's rearrangement pays completely",
            ),
            Law(formulas=("*",), slope=-1.0, because="f . f - r^2 is left with u / h: K is 2 r / h"),
        ),
    ),
    _ladder(
        name="SPH-IN",
        parameter="depth below the surface [r], seen from inside",
        values=(1.0, 0.9, 0.5, 0.1, 1e-2, 1e-3),
        draw=draws.inside,
        gate=Gate(reaches={"float32": 1e-2, "float64": 1e-3}),
        saturated=float("inf"),
        first_to_break="sphere/first_positive",
        survivor="all others: one root is behind, the other is far",
    ),
    _ladder(
        name="SPH-H0",
        parameter="distance [r] of an origin with f . d = 0 exactly; zeros of both signs",
        values=(0.5, 0.25, 0.125, 2.0**-10, 2.0**-20, 2.0**-30, 2.0, 1024.0),
        draw=draws.perpendicular,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1024.0, "float64": 1024.0}, misclassified=0.0),
        first_to_break="a stable quadratic with sign(0) = 0",
        survivor="all here: copysign",
    ),
    _ladder(
        name="SPH-ORG",
        parameter="distance of sphere and eye from the world's origin [r]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.translated,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e5, "float64": 1e6}),
        first_to_break="the inputs, not a formula: end to end u T / r",
        survivor="all: o - c is subtracted first and K_local is flat",
        laws=(Law(formulas=("*",), slope=0.0, because="the formula only sees o - c"),),
    ),
    _ladder(
        name="SPH-LARGE",
        parameter="uniform scale [m]",
        values=(1.0, 1e4, 1e8, 1e9, 1e10, 1e14, 1e18, 1e19, 1e20),
        draw=draws.scaled,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e9, "float64": 1e20}),
        first_to_break="sphere/textbook: products of four lengths overflow at 1e19 in float32",
        survivor="sphere/shift up to 1e19",
    ),
    _ladder(
        name="SPH-TINY",
        parameter="uniform scale [m]",
        values=(1.0, 1e-4, 1e-8, 1e-9, 1e-10, 1e-12, 1e-16, 1e-18, 1e-20, 1e-22),
        draw=draws.scaled,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-22}),
        first_to_break="sphere/textbook: products of four lengths lose digits to subnormals below 1e-10 in float32",
        survivor="sphere/shift down to 1e-18",
        measured="predicted: digits fade from 1e-19; from 1e-18 measured, where squares are subnormal and flushed",
    ),
    _ladder(
        name="SPH-FAST",
        parameter="length of the direction",
        values=(1.0, 1e2, 1e4, 1e6, 1e8, 1e10, 1e15, 1e18),
        draw=draws.fast,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e8, "float64": 1e18}),
        first_to_break="sphere/textbook",
        survivor="sphere/shift",
    ),
    _ladder(
        name="SPH-SLOW",
        parameter="length of the direction",
        values=(1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-15, 1e-18),
        draw=draws.fast,
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-18}),
        first_to_break="sphere/textbook",
        survivor="sphere/shift",
    ),
    _ladder(
        name="SPH-BEHIND",
        parameter="distance [r] of a sphere behind the ray",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1.0, 1e2, 1e4),
        draw=draws.behind,
        kind="count",
        gate=Gate(reaches={"float32": 1e4, "float64": 1e4}, misclassified=0.0),
        fails=(Failure(formulas=("first_positive",), because="erratum E3: takes a root behind the ray"),),
        first_to_break="a form whose far root may round to a positive number",
        survivor="all",
    ),
)
