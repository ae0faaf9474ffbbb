"""Ladders of special values: NaN, infinities, subnormals, signed zeros and the largest numbers, in every input."""

from itertools import combinations, product
from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, boxes, flat_shapes, spheres, triangles
from rayproof.cases.ladders.camera import cameras
from rayproof.cases.ladders.light import ways

# Draws. Special values in ordinary inputs: a single one for the value 1, in every pair of components for the value 2.
TINIEST = {"float32": (2.0**-149, 2.0**-127), "float64": (2.0**-1074, 2.0**-1023)}
LARGEST = {"float32": float(np.finfo(np.float32).max), "float64": float(np.finfo(np.float64).max)}
PAIRS = 4000  # at most


def specials(precision: str) -> tuple[float, ...]:
    """Return NaN, infinities, subnormals, zeros and the largest numbers, with both signs if there are two."""
    tiny, small = TINIEST[precision]
    return (np.nan, np.inf, -np.inf, tiny, -tiny, small, -0.0, 0.0, LARGEST[precision], -LARGEST[precision])


def planted(draw: Draw, value: float = 1.0) -> Draw:
    """Return a draw that replaces numbers in the inputs of `draw`, made at `value`, by special values."""

    def planting(places: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        plain = draw(value, 1, np.random.default_rng(5), precision)
        slots = [
            (name, index)
            for name, array in plain.items()
            if name not in ("fovy", "aspect", "near", "far")
            for index in np.ndindex(array.shape[1:])
        ]
        wanted = [
            [*zip(where, what, strict=True)]
            for where in combinations(slots, int(places))
            for what in product(specials(precision), repeat=int(places))
        ]
        if len(wanted) > max(count, 1000):
            wanted = [wanted[i] for i in np.sort(generator.choice(len(wanted), max(count, 1000), replace=False))]
        drawn = draw(value, len(wanted), generator, precision)
        for ray, plants in enumerate(wanted):
            for (name, index), special in plants:
                drawn[name][(ray, *index)] = special
        return drawn

    return planting


# The ladders.
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
        draw=planted(spheres.inside, 0.5),
        options={"shape": "sphere"},
        first_to_break="a clamp that turns a NaN discriminant into 0",
    ),
    _ladder(
        "special_distance",
        name="VAL-TRIANGLE",
        slots=("triangle",),
        draw=planted(triangles.slivers),
        options={"shape": "triangle"},
        fails=(
            Failure(
                formulas=("printed_third_row", "unsigned_areas"),
                because="errata E6 and E5: wrong on ordinary numbers too",
            ),
        ),
        first_to_break="a negated comparison, which is true for NaN",
    ),
    _ladder(
        "special_distance",
        name="VAL-PLANE",
        slots=("plane",),
        draw=planted(flat_shapes.plane_far),
        options={"shape": "plane"},
        first_to_break="plane/unguarded",
    ),
    _ladder(
        "special_distance",
        name="VAL-SQUARE",
        slots=("square",),
        draw=planted(flat_shapes.border, 1e6),
        options={"shape": "square"},
        fails=(Failure(formulas=("full_vectors",), because="erratum E7: twice the size"),),
        first_to_break="a negated comparison, which is true for NaN",
    ),
    _ladder(
        "special_distance",
        name="VAL-CUBE",
        slots=("cube",),
        draw=planted(boxes.around, 3.0),
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
