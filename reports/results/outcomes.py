"""`Outcome`: the eight outcomes and their order, their counts in a run, titles of the specification's items."""

from collections import Counter
from collections.abc import Iterable
from enum import StrEnum


class Outcome(StrEnum):
    """The verdict of a check or a case, from the best to the worst."""

    PASS = "pass"
    WARN = "warn"
    UNDECIDED = "undecided"  # too few pixels could be judged, or a reference abstained
    UNSUPPORTED = "unsupported"
    MISSING = "missing"
    REFERENCE_SUSPECT = "reference_suspect"
    ERROR = "error"
    FAIL = "fail"


MEASURED = frozenset({Outcome.PASS, Outcome.WARN, Outcome.FAIL, Outcome.REFERENCE_SUSPECT})  # outcomes of a comparison
LEDGER = ("planned", *(outcome.value for outcome in Outcome))


def worst(outcomes: Iterable[Outcome]) -> Outcome:
    """Return the worst outcome; MISSING if there are no outcomes, since nothing was measured.

    Undecided outcomes count only if there are no others.
    """
    order, results = list(Outcome), list(outcomes)
    decided = [outcome for outcome in results if outcome is not Outcome.UNDECIDED]
    return max(decided or results, key=order.index, default=Outcome.MISSING)


def ledger(outcomes: Iterable[Outcome], *, planned: int) -> dict[str, int]:
    """Return the number of each outcome, and the planned number; `outcomes` may be a `Counter`.

    Raises:
        ValueError: the sum is not `planned`: a check was lost or counted twice.

    """
    counts = Counter(outcomes)
    total = sum(counts.values())
    if total != planned:
        raise ValueError(f"planned {planned} but {total} have an outcome")
    return {"planned": planned, **{outcome.value: counts[outcome] for outcome in Outcome}}


def exit_code(outcomes: Iterable[Outcome]) -> int:
    """Return 0 if all outcomes are PASS or WARN, 1 if there is a failure, 3 if something could not be measured.

    UNDECIDED is neither a pass nor a failure; if there are no other outcomes, nothing was measured.
    """
    distinct = set(outcomes)
    if distinct & {Outcome.FAIL, Outcome.REFERENCE_SUSPECT}:
        return 1
    if distinct - {Outcome.PASS, Outcome.WARN, Outcome.UNDECIDED}:
        return 3
    return 0 if distinct & {Outcome.PASS, Outcome.WARN} else 3


def concerning(outcomes: Iterable[Outcome], *, tracer: bool) -> list[Outcome]:
    """Return the outcomes that decide a run's verdict.

    For a subject other than the tracer, UNSUPPORTED is ignored if another case passes.
    """
    results = list(outcomes)
    supported = [outcome for outcome in results if outcome is not Outcome.UNSUPPORTED]
    return results if tracer or not any(outcome in (Outcome.PASS, Outcome.WARN) for outcome in supported) else supported


TITLES: dict[str, str] = {
    "CAM-1": "view basis and view matrix",
    "CAM-2": "perspective projection matrix",
    "CAM-3": "pixel to normalised device coordinates",
    "CAM-4": "ray by the reference point",
    "CAM-5": "ray by the inverse matrices",
    "XF-1": "ray into object space",
    "XF-2": "hit point and normal back to world space",
    "HIT-1": "sphere, quadratic",
    "HIT-2": "clipping",
    "HIT-3": "cube, slabs",
    "HIT-4": "plane",
    "HIT-5": "triangle, barycentric areas",
    "HIT-6": "triangle, Möller-Trumbore",
    "HIT-7": "square in its local space",
    "HIT-8": "square by half-width and half-height",
    "HIT-9": "nearest hit over all geometry",
    "NRM-1": "sphere's local normal",
    "NRM-2": "cube's local normal",
    "NRM-3": "world normal by the inverse transpose",
    "LIT-1": "one shadow ray per light",
    "LIT-2": "against acne: ignore the last object hit",
    "LIT-3": "against acne: a minimum t",
    "LIT-4": "against acne: doubles",
    "LIT-5": "against acne: offset along the normal",
    "RAD-1": "irradiance of a point light",
    "RAD-2": "Lambert's law",
    "RAD-3": "the lecture's simplified point light",
    "RAD-4": "radiant exitance and radiance",
    "RAD-5": "radiance is invariant along a ray",
    "IMG-1": "how the image is stored",
}
