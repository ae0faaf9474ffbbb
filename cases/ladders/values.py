"""Ladders of special values: NaN, infinities, subnormals, signed zeros and the largest numbers, in every input."""

from typing import Any

from rayproof.cases.ladders.draws import box, sphere, triangle
from rayproof.cases.ladders.draws.camera import cameras
from rayproof.cases.ladders.draws.light import ways
from rayproof.cases.ladders.draws.special import planted
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder


def _ladder(question: str, **about: Any) -> Ladder:
    return Ladder(
        group="values",
        question=question,
        parameter="special values at a time",
        values=(1.0, 2.0),
        unit="plausible answers to impossible questions",
        condition="none: total or not",
        kind="values",
        rays=4000,
        quick_rays=1500,
        gate=Gate(reaches={"float32": 2.0, "float64": 2.0}, misclassified=0.0),
        survivor="a form in which every comparison is false for NaN",
        **about,
    )


LADDERS = (
    _ladder(
        "special_distance",
        name="VAL-SPHERE",
        slots=("sphere",),
        draw=planted(sphere.inside, 0.5),
        options={"shape": "sphere"},
        first_to_break="a clamp that turns a NaN discriminant into 0",
    ),
    _ladder(
        "special_distance",
        name="VAL-TRIANGLE",
        slots=("triangle",),
        draw=planted(triangle.slivers),
        options={"shape": "triangle"},
        fails=(
            Failure(
                formulas=(
                    "printed_third_row",
                    "unsigned_areas",
                ),
                because="errata E6 and E5: wrong on ordinary numbers too",
            ),
        ),
        first_to_break="a negated comparison, which is true for NaN",
    ),
    _ladder(
        "special_distance",
        name="VAL-PLANE",
        slots=("plane",),
        draw=planted(triangle.plane_far),
        options={"shape": "plane"},
        first_to_break="plane/unguarded",
    ),
    _ladder(
        "special_distance",
        name="VAL-SQUARE",
        slots=("square",),
        draw=planted(triangle.border, 1e6),
        options={"shape": "square"},
        fails=(Failure(formulas=("full_vectors",), because="erratum E7: twice the size"),),
        first_to_break="a negated comparison, which is true for NaN",
    ),
    _ladder(
        "special_distance",
        name="VAL-CUBE",
        slots=("cube",),
        draw=planted(box.around, 3.0),
        options={"shape": "cube"},
        fails=(
            Failure(
                formulas=("divides_anyway", "entry_only", "nan_dropping"),
                because="a comparison drops the NaN, and the other slabs alone bound the ray",
            ),
        ),
        first_to_break="cube/nan_dropping: a slab that is no number bounds nothing",
    ),
    _ladder(
        "special_camera",
        name="VAL-CAMERA",
        slots=("ray",),
        draw=planted(cameras()),
        first_to_break="a form that clamps",
    ),
    _ladder(
        "special_light",
        name="VAL-LIGHT",
        slots=("falloff", "cosine", "lambert", "simplified"),
        draw=planted(ways()),
        first_to_break="fmax(cosine, 0), which turns a NaN into a shadow",
    ),
)
