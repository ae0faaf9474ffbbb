"""Ladders of view rays: cameras near their target, far off, narrow, wide, tall, or looking along `up`."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, PredictedSlope, across, directions, rounded

# Draws. Cameras in random orientations: with an axis-aligned up some errors do not show at all.
ASPECT = 1.75  # exact in both precisions


def cameras(
    *,
    eye: float = 6.0,
    near: float = 0.125,
    far: float = 128.0,
    fovy: float = 60.0,
    aspect: float = ASPECT,
    lean: float = 1.0,
    swept: str = "",
) -> Draw:
    """Return a draw of cameras `eye` m from the origin; the value replaces the quantity called `swept`.

    Quantities: eye, near, ratio (far / near), fovy, aspect, lean (between F and up [rad]), flare (180 - fovy).
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"eye": eye, "near": near, "far": far, "fovy": fovy, "aspect": aspect, "lean": lean}
        if swept == "ratio":
            now["far"] = near * value
        elif swept == "flare":
            now["fovy"] = 180 - value
        elif swept:
            now[swept] = value
        position = rounded(directions(count, generator) * now["eye"], precision)
        forward = directions(count, generator)
        target = rounded(position + forward * 6.0, precision)
        up = np.cos(now["lean"]) * forward + np.sin(now["lean"]) * across(forward, generator)
        single = {name: rounded(np.full(count, now[name]), precision) for name in ("near", "far", "aspect", "fovy")}
        return {
            "eye": position,
            "target": target,
            "up": rounded(up, precision),
            "sx": rounded(generator.uniform(-1, 1, count), precision),
            "sy": rounded(generator.uniform(-1, 1, count), precision),
            **single,
        }

    return draw


# The ladders.
K_VIEW = "1 + 1 / sin(F, up), and near 180 degrees what a rounding of fovy turns: the eye's coordinates do not enter"
MULTIPLIED = ("matrix", "matrix_w_divide", "analytic_inverse")  # C3, C4, C5


def _ladder(**about: Any) -> Ladder:
    options = {"natural": about.pop("natural", "degrees")}
    fields: dict[str, Any] = {
        "group": "camera",
        "question": "view_ray",
        "slots": ("ray",),
        "unit": "degrees",
        "condition": K_VIEW,
        "saturated": 10.0,
        "rays": 2000,
        "quick_rays": 400,
    }
    return Ladder(**(fields | about), options=options)


FAILING = (
    Failure(formulas=MULTIPLIED, because="w multiplies the eye: 30 K u at far / near = 1024 and 6 m from the origin"),
    Failure(formulas=("half_depth",), because="erratum E14: w is not 1 halfway into the depth range"),
)
LADDERS = (
    _ladder(
        name="CAM-NEAR",
        parameter="near [m], far 128 m, eye 6 m from the origin",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=cameras(swept="near"),
        gate=Gate(reaches={"float32": 1e-8, "float64": 1e-8}, index=10.0),
        fails=(
            Failure(formulas=MULTIPLIED, because="w is off by u far / near and multiplies the eye"),
            Failure(formulas=("half_depth",), because="erratum E14: w is not 1 halfway into the depth range"),
            Failure(
                formulas=("w_divided_in_view",), because="w is 0 from far / near = 2 / u on", precisions=("float32",)
            ),
        ),
        first_to_break="ray/matrix, matrix_w_divide, analytic_inverse (C3, C4, C5)",
        survivor="ray/reference_free, rotated (C2, C6)",
        slopes=(
            PredictedSlope(formulas=MULTIPLIED, slope=-1.0, because="w is off by u far / near and multiplies the eye"),
        ),
    ),
    _ladder(
        name="CAM-NEAR-ORIGIN",
        parameter="near [m], far 128 m, eye at the origin",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=cameras(swept="near", eye=0.0),
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-5}, index=10.0),
        fails=(Failure(formulas=("analytic_inverse",), because="w is 0 at far / near = 1e7", precisions=("float32",)),),
        first_to_break="none: w multiplies an eye of zero",
        survivor="all: an ordinary scene hides the fault",
        slopes=(PredictedSlope(formulas=MULTIPLIED, slope=0.0, because="w multiplies an eye of zero"),),
    ),
    _ladder(
        name="CAM-RATIO",
        parameter="far / near, near 1/8 m",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10),
        draw=cameras(swept="ratio"),
        gate=Gate(reaches={"float32": 1e10, "float64": 1e10}, index=100.0),
        fails=(
            Failure(
                formulas=("matrix_w_divide", "analytic_inverse", "w_divided_in_view"),
                because="w is 0 from far / near = 2 / u on: no ray is a number",
                precisions=("float32",),
            ),
            Failure(formulas=("half_depth",), because="erratum E14: w is not 1 halfway into the depth range"),
        ),
        first_to_break="ray/matrix_w_divide (C4), dead at 1e8",
        survivor="ray/reference_free, rotated (C2, C6)",
    ),
    _ladder(
        name="CAM-FAR",
        parameter="distance of the eye from the world's origin [m], target 6 m on",
        values=(1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=cameras(swept="eye"),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}, index=10.0),
        fails=(
            Failure(formulas=MULTIPLIED, because="the eye is added and subtracted, times w"),
            Failure(formulas=("half_depth",), because="erratum E14: w is not 1 halfway into the depth range"),
            Failure(
                formulas=("reference_point_at_target", "inverse_matrices", "w_divided_in_view"),
                because="the eye is added and subtracted",
            ),
        ),
        first_to_break="ray/matrix, then reference_point_at_target (C1)",
        survivor="ray/reference_free (C2)",
        measured="predicted: reference_point (C1) off by u T / len. The default puts its reference point as far "
        "off as the eye is from the origin and stays flat; reference_point_at_target is the form that "
        "was predicted for",
        slopes=(
            PredictedSlope(
                formulas=("reference_point", "reference_free", "rotated"), slope=0.0, because="no eye is left over"
            ),
            PredictedSlope(formulas=MULTIPLIED, slope=1.0, because="p - eye is left with u T"),
            PredictedSlope(
                formulas=("reference_point_at_target", "inverse_matrices", "w_divided_in_view"),
                slope=1.0,
                skip=3,
                because="p - eye is left with u T, from where that exceeds the roundings of a near eye",
            ),
        ),
    ),
    _ladder(
        name="CAM-NARROW",
        slots=("ray", "half_extent"),
        parameter="fovy [degrees]",
        values=(60.0, 10.0, 1.0, 0.1, 1e-2, 1e-3, 1e-4),
        draw=cameras(swept="fovy"),
        unit="pixels of 1080 lines",
        natural="pixels",
        saturated=float("inf"),
        gate=Gate(reaches={"float32": 1e-4, "float64": 1e-4}, index=10.0),
        fails=FAILING,
        first_to_break="all in pixels: the direction is as good as ever, a pixel is smaller",
        survivor="float64",
        measured="found: Dr.Jit's float64 tangent is off by alpha^2 / 3 below 1e-4, 1 800 K u at fovy 0.01; "
        "half_extent divides sine by cosine since",
        slopes=(
            PredictedSlope(formulas=("reference_free",), slope=-1.0, because="the same angle, ever smaller pixels"),
        ),
    ),
    _ladder(
        name="CAM-WIDE",
        parameter="180 - fovy [degrees]",
        values=(90.0, 10.0, 1.0, 0.1, 1e-2),
        draw=cameras(swept="flare"),
        gate=Gate(reaches={"float32": 1e-1, "float64": 1e-1}, index=10.0),
        fails=FAILING,
        first_to_break="none in this range",
        survivor="all",
    ),
    _ladder(
        name="CAM-ASPECT",
        parameter="aspect",
        values=(1.0, 1e1, 1e2, 1e4, 1e6),
        draw=cameras(swept="aspect"),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}, index=10.0),
        fails=FAILING,
        first_to_break="none",
        survivor="all",
    ),
    _ladder(
        name="CAM-TALL",
        parameter="aspect",
        values=(1.0, 1e-1, 1e-2, 1e-4, 1e-6),
        draw=cameras(swept="aspect"),
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-6}, index=10.0),
        fails=FAILING,
        first_to_break="none",
        survivor="all",
    ),
    _ladder(
        name="CAM-UP",
        slots=("ray", "basis"),
        parameter="angle between up and the viewing direction [rad]",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=cameras(lean=1.0, swept="lean"),
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-6}, index=10.0),
        fails=FAILING,
        first_to_break="all alike: K is 1 / angle",
        survivor="a fall-back up vector",
        slopes=(
            PredictedSlope(
                formulas=("right_handed", "reference_free"), slope=-1.0, skip=2, because="F x up is left with u / angle"
            ),
        ),
    ),
)
