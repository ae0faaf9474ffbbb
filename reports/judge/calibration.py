"""Constants for references whose own rounding is unknown: calibrated, labelled as such, frozen with their origin.

A reference's limit is the derived one at its own precision times this constant. `analytic` needs none: its formulas
are ours to count. A constant here is never widened to make a run pass; it is measured again, and the origin says how.
"""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A reference's constant and where it comes from."""

    factor: float
    origin: str


DERIVED = Calibration(factor=1.0, origin="derived: float64 with the same counts of roundings")
CALIBRATED: dict[str, Calibration] = {
    # Measured over the default suite: no stage of Mitsuba 3.9.1 used more than 0.2 of the float32 limits with factor 1.
    "mitsuba_scalar": Calibration(factor=1.0, origin="calibrated on Mitsuba 3.9.1: factor 1 at float32"),
    "mitsuba_llvm": Calibration(factor=1.0, origin="calibrated on Mitsuba 3.9.1: factor 1 at float32"),
}


def calibration(reference: str) -> Calibration:
    """Return a reference's constant; 1 where the limits are derived."""
    return CALIBRATED.get(reference, DERIVED)
