"""Ladders of camera matrices, frustum corners, NDC and pixels, sample positions, and rays cut by clip planes."""

import math
from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, PredictedSlope, across, directions, rounded

# Draws. Numbers that a camera is made of: places in an image, axes, half-sizes, matrices, and rays at its clip planes.
NEAR, FAR, FOVY, ASPECT = 0.125, 8.0, 60.0, 1.75
PER_SIDE = 3  # no power of two: a division that rounds


def _full(count: int, value: float, precision: str) -> np.ndarray:
    return rounded(np.full(count, value), precision)


def samples(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return samples of an image with `width` columns and rows of samples, PER_SIDE per side of a pixel."""
    places = generator.integers(0, int(width), (2, count)).astype(np.float64)
    return {"column": places[0], "row": places[1], "per_side": np.full(count, float(PER_SIDE))}


def _size(width: float, count: int) -> Inputs:
    """Return a landscape image, since a square one would hide swapped sides."""
    return {"width": np.full(count, width), "height": np.full(count, np.floor(0.7 * width))}


def pixels(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return centres of pixels of an image `width` pixels wide."""
    size = _size(width, count)
    px, py = (rounded(np.floor(generator.uniform(0, size[side])) + 0.5, precision) for side in ("width", "height"))
    return {"px": px, "py": py} | size


def places(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return normalised device coordinates, and an image `width` pixels wide."""
    ndc = rounded(generator.uniform(-1, 1, (2, count)), precision)
    return {"sx": ndc[0], "sy": ndc[1]} | _size(width, count)


def frames(*, eye: float = 6.0, fovy: float = FOVY, near: float = NEAR, far: float = FAR, swept: str = "") -> Draw:
    """Return a draw of cameras by their own numbers: eye, axes in random orientation, half-sizes, near and far.

    The value replaces the quantity called `swept`: eye (distance from the origin [m]), fovy [degrees], ratio
    (far / near) or depth (far / near - 1).
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"eye": eye, "fovy": fovy, "far": far} | ({swept: value} if swept in ("eye", "fovy") else {})
        if swept in ("ratio", "depth"):
            now["far"] = near * (value if swept == "ratio" else 1 + value)
        forward = directions(count, generator)
        right = across(forward, generator)
        # Sizes differ from camera to camera, so that no quotient is an exact one.
        vertical = math.tan(math.radians(now["fovy"]) / 2) * generator.uniform(0.7, 1.4, count)
        scale = generator.uniform(0.7, 1.4, count)
        return {
            "eye": rounded(directions(count, generator) * now["eye"], precision),
            "right": rounded(right, precision),
            "up": rounded(np.cross(right, forward), precision),
            "forward": rounded(forward, precision),
            "horizontal": rounded(vertical * ASPECT, precision),
            "vertical": rounded(vertical, precision),
            "near": rounded(near * scale, precision),
            "far": rounded(now["far"] * scale, precision),
        }

    return draw


def matrices(kind: str, frames: Draw) -> Draw:
    """Return a draw of the matrices "view" or "projection" of the cameras of `frames`, entry by entry."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        x = frames(value, count, generator, precision)
        m = np.zeros((count, 4, 4))
        if kind == "view":
            for row, axis in enumerate(("right", "up", "forward")):
                m[:, row, :3] = x[axis]
                m[:, row, 3] = -np.sum(x[axis] * x["eye"], axis=1)
            m[:, 3, 3] = 1
        else:
            stretch = x["far"] / (x["far"] - x["near"])
            m[:, 0, 0], m[:, 1, 1] = 1 / x["horizontal"], 1 / x["vertical"]
            m[:, 2, 2], m[:, 2, 3], m[:, 3, 2] = stretch, -x["near"] * stretch, 1
        m = rounded(m, precision)
        return {f"m{i}{j}": m[:, i, j].copy() for i in range(4) for j in range(4)}

    return draw


def slanted(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit directions at this cosine to the viewing direction, and near and far."""
    forward = directions(count, generator)
    direction = cosine * forward + math.sqrt(1 - cosine**2) * across(forward, generator)
    return {
        "direction": rounded(direction, precision),
        "forward": rounded(forward, precision),
        "near": rounded(generator.uniform(0.1, 0.2, count), precision),
        "far": rounded(generator.uniform(5, 10, count), precision),
    }


def at_planes(*, shell: bool) -> Draw:
    """Return a draw of hits about `value` roundings before or behind the near or the far plane, or `shell`."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        u = 2.0**-24 if precision == "float32" else 2.0**-53
        x = slanted(float(generator.uniform(0.3, 0.9)), count, generator, precision)
        depth = np.where(generator.random(count) < 0.5, x["near"], x["far"])
        off = 1 + value * u * np.where(generator.random(count) < 0.5, -1, 1) * generator.uniform(1, 2, count)
        cosine = 1.0 if shell else np.sum(x["direction"] * x["forward"], axis=1)
        return x | {"t": rounded(depth / cosine * off, precision)}

    return draw


def anywhere(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return hits about `distance` m before or behind the eye."""
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    x = slanted(0.7, count, generator, precision)
    return x | {"t": rounded(side * distance * generator.uniform(0.5, 1, count), precision)}


# The ladders.
K_VALUE = "sum of |x df/dx| over the inputs x of the very expression, over its value"
ANGLES = (179.9, 170.0, 120.0, 60.0, 10.0, 1.0, 1e-1, 1e-2, 1e-3)
RATIOS = (1e1, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12)
WIDTHS = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
FARTHER = (1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6)


def _value(slot: str, natural: str, slope: float | None, because: str, **about: Any) -> Ladder:
    last = about["values"][-1]
    formulas = about.pop("formulas", ("*",))
    skip = about.pop("skip", 0)
    fields: dict[str, Any] = {
        "group": "camera",
        "question": "value",
        "slots": (slot,),
        "unit": natural,
        "condition": K_VALUE,
        "saturated": float("inf"),
        "options": {"natural": natural},
        "gate": Gate(reaches={"float32": last, "float64": last}),
        "slopes": ()
        if slope is None
        else (PredictedSlope(formulas=formulas, slope=slope, because=because, skip=skip),),
        "first_to_break": "none",
        "survivor": "all",
    }
    return Ladder(**(fields | about))


def _decision(slot: str, **about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "camera",
        "question": "decision",
        "slots": (slot,),
        "unit": "hits on the wrong side",
        "condition": "none: right or wrong",
        "kind": "count",
        "survivor": "all",
    }
    return Ladder(**(fields | about))


LADDERS = (
    _value(
        "sample",
        "roundings",
        0.0,
        "a column and a half is exact below 2^23, and one division is left",
        name="SMP-WIDE",
        parameter="columns of the image [samples], three to a pixel",
        values=WIDTHS,
        draw=samples,
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
        draw=pixels,
    ),
    _value(
        "pixel",
        "pixels",
        1.0,
        "(sx + 1) W / 2 is left with u W pixels",
        name="PIX-WIDE",
        parameter="width of the image [pixels]",
        values=WIDTHS,
        draw=places,
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "far - near rounds once, and quotients and products follow",
        name="PRJ-RATIO",
        parameter="far / near, near 1/8 m",
        values=RATIOS,
        draw=frames(swept="ratio"),
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "far - near is exact where far < 2 near (Sterbenz): K grows, the error does not",
        name="PRJ-THIN",
        parameter="far / near - 1",
        values=(0.5, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=frames(swept="depth"),
    ),
    _value(
        "projection",
        "roundings",
        0.0,
        "the tangent is given: a reciprocal rounds once at every angle",
        name="PRJ-FOVY",
        parameter="fovy [degrees]",
        values=ANGLES,
        draw=frames(swept="fovy"),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the largest numbers are translations: sums of three products over a determinant of about 1",
        name="INV-FAR",
        parameter="distance of the eye from the world's origin [m]; view matrices",
        values=FARTHER,
        draw=matrices("view", frames(swept="eye")),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the determinant has one product only",
        name="INV-RATIO",
        parameter="far / near; projection matrices",
        values=RATIOS,
        draw=matrices("projection", frames(swept="ratio")),
    ),
    _value(
        "inverse",
        "roundings of the largest",
        0.0,
        "the determinant has one product only",
        name="INV-FOVY",
        parameter="fovy [degrees]; projection matrices",
        values=ANGLES,
        draw=matrices("projection", frames(swept="fovy")),
    ),
    _value(
        "view",
        "m",
        1.0,
        "the axes times the eye are left with u T",
        name="VIEW-FAR",
        parameter="distance of the eye from the world's origin [m]",
        values=FARTHER,
        draw=frames(swept="eye"),
    ),
    _value(
        "corners",
        "m",
        1.0,
        "eye + depth (...) is left with u T, from where that exceeds the roundings of the far plane",
        name="CORN-FAR",
        parameter="distance of the eye from the world's origin [m]",
        values=FARTHER,
        draw=frames(swept="eye"),
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
        draw=frames(swept="fovy"),
    ),
    _value(
        "clip_depth",
        "roundings",
        -1.0,
        "the cosine is a sum of three products, left with u whatever its size",
        name="CLIP-WIDE",
        parameter="cosine between ray and viewing direction",
        values=(1.0, 0.5, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=slanted,
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
        draw=at_planes(shell=False),
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
        draw=at_planes(shell=True),
        gate=Gate(reaches={"float32": 1.0, "float64": 1.0}, misclassified=0.0),
        first_to_break="none: two comparisons of given numbers are exact",
    ),
    _decision(
        "clip_none",
        name="CLIP-NONE",
        parameter="distance of hits before and behind the eye [m]",
        values=(1.0, 1e10, 1e20, 1e30, 1e38, 1e-10, 1e-20, 1e-30, 1e-37),
        draw=anywhere,
        gate=Gate(reaches={"float32": 1e-37, "float64": 1e-37}, misclassified=0.0),
        first_to_break="none: comparisons with 0 and infinity are exact",
    ),
)
