"""Ladders of light feelers, of irradiance and of the cosine."""

from typing import Any

from cases.ladders.draws.light import balls, floors, ways
from cases.ladders.draws.special import dark
from cases.ladders.ladder import Failure, Gate, Ladder, Law

NO_K = "none: lit or not"
BOUNDED = ("normal_offset", "error_bound", "minimum_t", "doubles")
ULPS = "1: error / ulp of the result"


def _feeler(**about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "light and shadow",
        "question": "shadow",
        "slots": ("feeler",),
        "unit": "acne and leaks, rays",
        "condition": NO_K,
        "kind": "count",
        "rays": 20_000,
        "quick_rays": 2_000,
    }
    last = about["values"][-1]
    # Not one ray in 20 000 for the strategies that bound the error; of the others a handful are forgiven.
    gate: Any = Gate(reaches={"float32": last, "float64": last}, misclassified=2e-4, faultless=BOUNDED)
    return Ladder(**({"gate": gate} | given | about))


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
    _feeler(
        name="SHD-GROW",
        parameter="scale of the scene [m], gap 1e-3 of it",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=floors(swept="scale"),
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="one length for every scale",
                precisions=("float32",),
            ),
        ),
        first_to_break="feeler/none, fixed_minimum_t, fixed_offset",
        survivor="feeler/error_bound",
        measured="predicted: 0.005 to 0.4 % acne for waechter_binder; 0.005 % measured with planes anchored up to 4 "
        "scales away, and none with anchors nearer",
    ),
    _feeler(
        name="SHD-SHRINK",
        parameter="scale of the scene [m], gap 1e-3 of it",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6),
        draw=floors(swept="scale"),
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="one length for every scale",
            ),
            Failure(
                formulas=(
                    "mitsuba",
                    "waechter_binder",
                ),
                because="an offset that is absolute near the origin",
                precisions=("float32",),
            ),
        ),
        first_to_break="feeler/none, fixed_minimum_t, fixed_offset, mitsuba, waechter_binder",
        survivor="feeler/error_bound",
    ),
    _feeler(
        name="SHD-FAR",
        parameter="distance of the scene from the world's origin [m], gap 1e-3 m",
        values=(0.0, 1e1, 1e2, 1e3, 1e4),
        draw=floors(swept="offset"),
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "normal_offset",
                    "error_bound",
                    "minimum_t",
                    "mitsuba",
                    "waechter_binder",
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="the offset, or what rounding does to the hit, reaches the gap",
                precisions=("float32",),
            ),
            Failure(formulas=("relative_minimum_t",), because="grows with the distance from the origin, not with size"),
        ),
        first_to_break="feeler/relative_minimum_t, mitsuba",
        survivor="none where u T reaches the gap: the information is gone",
        measured="predicted: the error bound leaks 4 % at 1e2 and 82 % at 1e3; 0 and 100 % measured, the "
        "clearance being twice as tight at first and never clipped",
    ),
    _feeler(
        name="SHD-GAP",
        parameter="gap [m] at scale 1 m",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=floors(swept="gap"),
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "normal_offset",
                    "error_bound",
                    "minimum_t",
                    "mitsuba",
                    "waechter_binder",
                ),
                because="the offset, or what rounding does to the hit, reaches the gap",
                precisions=("float32",),
            ),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                    "relative_minimum_t",
                ),
                because="one length for every gap",
            ),
        ),
        first_to_break="feeler/fixed_minimum_t, mitsuba",
        survivor="feeler/error_bound down to 1e-4",
    ),
    _feeler(
        name="SHD-GRAZE",
        parameter="cosine of view and of light",
        values=(0.5, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3),
        draw=floors(swept="cosine"),
        fails=(
            Failure(
                formulas=("relative_minimum_t",),
                because="too short where light and view graze: the error along the feeler is a height over the cosine",
                precisions=("float32",),
            ),
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=("error_bound",), because="the box around o + t d grows as 1 / cos", precisions=("float32",)
            ),
        ),
        first_to_break="feeler/none",
        survivor="feeler/normal_offset",
    ),
    _feeler(
        name="SHD-BALL-GROW",
        parameter="radius of a sphere [m], gap 1e-3 of it",
        values=(1.0, 1e2, 1e4, 1e6),
        draw=balls(swept="scale"),
        options={"surface": "sphere"},
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="one length for every scale",
                precisions=("float32",),
            ),
        ),
        first_to_break="feeler/none",
        survivor="feeler/error_bound, normal_offset",
    ),
    _feeler(
        name="SHD-BALL-SHRINK",
        parameter="radius of a sphere [m], gap 1e-3 of it",
        values=(1.0, 1e-2, 1e-4, 1e-6),
        draw=balls(swept="scale"),
        options={"surface": "sphere"},
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="one length for every scale",
            ),
            Failure(
                formulas=(
                    "mitsuba",
                    "waechter_binder",
                ),
                because="an offset that is absolute near the origin",
                precisions=("float32",),
            ),
        ),
        first_to_break="feeler/none",
        survivor="feeler/error_bound, normal_offset",
    ),
    _feeler(
        name="SHD-BALL-FAR",
        parameter="distance of the sphere from the world's origin [r], gap 1e-3 r",
        values=(0.0, 1e1, 1e2, 1e3),
        draw=balls(swept="offset"),
        options={"surface": "sphere"},
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "normal_offset",
                    "error_bound",
                    "minimum_t",
                    "mitsuba",
                    "waechter_binder",
                    "fixed_minimum_t",
                ),
                because="the offset, or what rounding does to the hit, reaches the gap",
                precisions=("float32",),
            ),
            Failure(formulas=("relative_minimum_t",), because="grows with the distance from the origin, not with size"),
        ),
        first_to_break="feeler/none",
        survivor="feeler/error_bound",
    ),
    _feeler(
        name="SHD-BALL-REPROJECTED",
        parameter="distance of the sphere from the world's origin [r], gap 1e-3 r, points reprojected",
        values=(0.0, 1e1, 1e2, 1e3),
        draw=balls(swept="offset"),
        options={"surface": "sphere", "reprojected": True},
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(
                formulas=(
                    "normal_offset",
                    "error_bound",
                    "minimum_t",
                    "mitsuba",
                    "waechter_binder",
                    "fixed_minimum_t",
                ),
                because="the offset, or what rounding does to the hit, reaches the gap",
                precisions=("float32",),
            ),
            Failure(formulas=("relative_minimum_t",), because="grows with the distance from the origin, not with size"),
        ),
        first_to_break="feeler/none",
        survivor="feeler/error_bound",
        measured="predicted: reprojection clean up to 1e3; the clearance that a strategy gets does not know of "
        "it, and leaks all the same at 1e3",
    ),
    _feeler(
        name="SHD-SELF",
        parameter="gap [m] between a point and another part of the same shape, which is in the way",
        values=(1e-1, 1e-2, 2e-3),
        draw=floors(swept="gap"),
        options={"self_shadow": True},
        fails=(
            Failure(formulas=("none",), because="half of all hits lie below their surface"),
            Failure(formulas=("skip_last",), because="the shape that was left casts no shadow on itself"),
        ),
        first_to_break="feeler/skip_last: every light shines through",
        survivor="feeler/error_bound, normal_offset",
    ),
    _feeler(
        name="SHD-COPLANAR",
        parameter="scale [m] of two coplanar neighbours that share the point",
        values=(1.0, 1e2, 1e4),
        draw=floors(swept="scale"),
        options={"adjacent": True},
        fails=(
            Failure(
                formulas=(
                    "none",
                    "skip_last",
                ),
                because="half of all hits lie below the surface, and the neighbour is not left out",
            ),
            Failure(
                formulas=(
                    "fixed_minimum_t",
                    "fixed_offset",
                ),
                because="one length for every scale",
                precisions=("float32",),
            ),
        ),
        first_to_break="feeler/skip_last: the neighbour is not the shape that was left",
        survivor="feeler/error_bound, normal_offset",
    ),
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
        condition=NO_K,
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
