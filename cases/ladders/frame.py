"""Ladders of what a camera is made of: pixels, matrices, corners, and what its clip planes leave of a ray."""

from typing import Any

from rayproof.cases.ladders.draws import frame as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

K_VALUE = "sum of |x df/dx| over the inputs x of the very expression, over its value"
ANGLES = (179.9, 170.0, 120.0, 60.0, 10.0, 1.0, 1e-1, 1e-2, 1e-3)
RATIOS = (1e1, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12)
WIDTHS = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
FARTHER = (1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6)


def _value(slot: str, natural: str, slope: float | None, because: str, **about: Any) -> Ladder:
    last = about["values"][-1]
    formulas = about.pop("formulas", ("*",))
    skip = about.pop("skip", 0)
    given: dict[str, Any] = {
        "group": "camera",
        "question": "value",
        "slots": (slot,),
        "unit": natural,
        "condition": K_VALUE,
        "saturated": float("inf"),
        "options": {"natural": natural},
        "gate": Gate(reaches={"float32": last, "float64": last}),
        "laws": () if slope is None else (Law(formulas=formulas, slope=slope, because=because, skip=skip),),
        "first_to_break": "none",
        "survivor": "all",
    }
    return Ladder(**(given | about))


def _decision(slot: str, **about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "camera",
        "question": "decision",
        "slots": (slot,),
        "unit": "hits on the wrong side",
        "condition": "none: right or wrong",
        "kind": "count",
        "survivor": "all",
    }
    return Ladder(**(given | about))


LADDERS = (
    _value(
        "sample",
        "roundings",
        0.0,
        "a column and a half is exact below 2^23, and one division is left",
        name="SMP-WIDE",
        parameter="columns of the image [samples], three to a pixel",
        values=WIDTHS,
        draw=draws.samples,
        formulas=("centre",),
        fails=(Failure(formulas=("corner",), because="erratum E1: half a sample off"),),
        first_to_break="sample/corner",
        survivor="sample/centre",
    ),
    _value(
        "ndc",
        "pixels",
        1.0,
        "2 px / W - 1 is left with u, which is u W / 2 pixels",
        name="NDC-WIDE",
        parameter="width of the image [pixels]",
        values=WIDTHS,
        draw=draws.pixels,
    ),
    _value(
        "pixel",
        "pixels",
        1.0,
        "(sx + 1) W / 2 is left with u W pixels",
        name="PIX-WIDE",
        parameter="width of the image [pixels]",
        values=WIDTHS,
        draw=draws.places,
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "far - near rounds once, and quotients and products follow",
        name="PRJ-RATIO",
        parameter="far / near, near 1/8 m",
        values=RATIOS,
        draw=draws.frames(swept="ratio"),
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "far - near is exact where far < 2 near (Sterbenz): K grows, the error does not",
        name="PRJ-THIN",
        parameter="far / near - 1",
        values=(0.5, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=draws.frames(swept="depth"),
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "the tangent is given: a reciprocal rounds once at every angle",
        name="PRJ-FOVY",
        parameter="fovy [degrees]",
        values=ANGLES,
        draw=draws.frames(swept="fovy"),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the largest numbers are translations: sums of three products over a determinant of about 1",
        name="INV-FAR",
        parameter="distance of the eye from the world's origin [m]; view matrices",
        values=FARTHER,
        draw=draws.matrices("view", draws.frames(swept="eye")),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the determinant has one product only",
        name="INV-RATIO",
        parameter="far / near; projection matrices",
        values=RATIOS,
        draw=draws.matrices("projection", draws.frames(swept="ratio")),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the determinant has one product only",
        name="INV-FOVY",
        parameter="fovy [degrees]; projection matrices",
        values=ANGLES,
        draw=draws.matrices("projection", draws.frames(swept="fovy")),
    ),
    _value(
        "view",
        "m",
        1.0,
        "the axes times the eye are left with u T",
        name="VIEW-FAR",
        parameter="distance of the eye from the world's origin [m]",
        values=FARTHER,
        draw=draws.frames(swept="eye"),
    ),
    _value(
        "corners",
        "m",
        1.0,
        "eye + depth (...) is left with u T, from where that exceeds the roundings of the far plane",
        name="CORN-FAR",
        parameter="distance of the eye from the world's origin [m]",
        values=FARTHER,
        draw=draws.frames(swept="eye"),
        skip=2,
        first_to_break="none: a corner cannot be nearer than its own rounding",
    ),
    _value(
        "corners",
        "roundings of the largest",
        0.0,
        "half-sizes are given: sums of a few products at every angle",
        name="CORN-FOVY",
        parameter="fovy [degrees]",
        values=ANGLES,
        draw=draws.frames(swept="fovy"),
    ),
    _value(
        "clip_depth",
        "roundings",
        -1.0,
        "the cosine is a sum of three products, left with u whatever its size",
        name="CLIP-WIDE",
        parameter="cosine between ray and viewing direction",
        values=(1.0, 0.5, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=draws.slanted,
        formulas=("planes",),
        skip=2,
        fails=(Failure(formulas=("shell",), because="erratum E2: distances for depths"),),
        first_to_break="clip_depth/shell",
        survivor="clip_depth/planes",
    ),
    _decision(
        "clip_depth",
        name="CLIP-PLANES",
        parameter="hits before and behind near and far [roundings]",
        values=(1e6, 1e5, 1e4, 1e3, 1e2, 3e1, 1e1),
        draw=draws.at_planes(shell=False),
        gate=Gate(reaches={"float32": 3e1, "float64": 3e1}),
        fails=(Failure(formulas=("shell",), because="erratum E2: distances for depths"),),
        first_to_break="clip_depth/shell; planes from gamma(5) (1 + 1 / cos) on",
        survivor="clip_depth/planes",
    ),
    _decision(
        "clip_shell",
        name="CLIP-SHELL",
        parameter="hits before and behind near and far [roundings]",
        values=(1e6, 1e4, 1e2, 1e1, 3.0, 1.0),
        draw=draws.at_planes(shell=True),
        gate=Gate(reaches={"float32": 1.0, "float64": 1.0}, misclassified=0.0),
        first_to_break="none: two comparisons of given numbers are exact",
    ),
    _decision(
        "clip_none",
        name="CLIP-NONE",
        parameter="distance of hits before and behind the eye [m]",
        values=(1.0, 1e10, 1e20, 1e30, 1e38, 1e-10, 1e-20, 1e-30, 1e-37),
        draw=draws.anywhere,
        gate=Gate(reaches={"float32": 1e-37, "float64": 1e-37}, misclassified=0.0),
        first_to_break="none: comparisons with 0 and infinity are exact",
    ),
)
