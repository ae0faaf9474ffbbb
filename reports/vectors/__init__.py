"""Test vectors: inputs and certified answers of ray formulas, as files that a library in any language can run.

    rows        chosen rays of the ladders, rows made by hand, relations between rows
    shapes      exact answers and limits for ray and sphere, box, plane, triangle and square
    values      certified answers and limits for cameras, normals, shadow rays and light
    files       CSV, JSON, its schema and the digest
    check       scores an answer file; is written with the vectors and uses only Python's standard library
    answering   answers of the tracer's own formulas
    judging     the score, the breakpoint of every ladder, the worst row, the formulas that fail alike

docs/vectors.md specifies the format. No answer comes from a compiled kernel, and no limit from floating-point
arithmetic: both are computed with rational numbers and balls, so that the files are the same to the last bit
everywhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import ROUND_CEILING, Context, Decimal

from flint import arb

from rayproof.cases.ladders import Inputs
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reports.judge.forward.limits import HIT, LIGHT, NORMAL, RAY

BITS = 256  # of the balls
ROUNDINGS = max(RAY, HIT, NORMAL, LIGHT)  # of a straightforward evaluation: the largest of the judge's counts
# File -> the slots whose formulas its rows test.
SLOTS_OF: dict[str, tuple[str, ...]] = {
    "camera_ray": (
        *("half_extent", "basis", "view", "projection", "inverse", "sample", "ndc", "ray"),
        *("clip_depth", "clip_shell", "clip_none"),
    ),
    "sphere": ("sphere",),
    "box": ("cube", "to_object", "position"),
    "plane": ("plane",),
    "triangle": ("triangle",),
    "square": ("square",),
    "normals": ("sphere_normal", "cube_normal", "world_normal", "facing"),
    "shadow_ray": ("horizon", "shadow_ray", "segment", "obstructed"),
    "irradiance": ("falloff", "cosine", "lambert", "simplified", "sum_lights"),
    "radiance": ("exitance", "radiance", "radiance_simplified", "hidden"),
    "nearest": ("nearest",),
}
NO_FILE = {
    "corners": "a frustum's corners are no question about a ray",
    "pixel": "back from the image to its pixel is no question about a ray",
}
Numbers = tuple[float, ...] | float | str
Enclosure = tuple[float, float]  # the float64 numbers next below and above, equal if the number is a float64


@dataclass(frozen=True, kw_only=True)
class Exact:
    """The right answer of a row."""

    decision: Mapping[str, str] = field(default_factory=dict)  # precision -> the required decision, or either
    values: Mapping[str, Enclosure] = field(default_factory=dict)  # answer column (of t: t_in, t_out) -> bounds
    limits: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # group -> precision -> absolute limit
    clearance: float | None = None  # m, between the ray and the outline
    start: str = ""  # the start of a ray at a solid: outside, inside, on
    face: str = ""  # the visible side of a flat shape: front, back


@dataclass(frozen=True, kw_only=True)
class Row:
    """One vector."""

    file: str  # of FILES; rows of extreme scale are written to a separate file
    question: str  # of the file's questions
    kind: str  # core, inside, direction, behind, tie, shared, reported, special
    item: str  # of the specification
    inputs: Mapping[str, Numbers]
    exact: Exact
    why: str
    space: str = "world"
    sided: str = ""  # two: a flat shape is hit from both sides
    flags: tuple[str, ...] = ()
    ladder: str = ""
    value: float | None = None  # of the ladder's parameter
    ray: int = 0  # index in the ladder, the same for all rows of a ray
    given: Inputs = field(default_factory=dict)  # the ladder's inputs of that ray, (1,) or (1, n)


def ball_limit(noise: arb, precision: str, roundings: float = ROUNDINGS) -> arb:
    """Return the error of `roundings` roundings of numbers of size `noise`."""
    return noise * arb(roundings) * arb(UNIT_ROUNDOFF[precision])


def upwards(value: arb) -> float:
    """Return a limit rounded up to three digits, which every language reads as the same number."""
    return float(Context(prec=3, rounding=ROUND_CEILING).create_decimal(Decimal(float(value.upper()))))
