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
    baked_normals: bool = False  # takes triangles' normals from the float32 corners in world space
    placed_corners: bool = False  # takes squares' and cubes' normals from corners in world space, at its own precision


DERIVED = Calibration(factor=1.0, origin="derived: float64 with the same counts of roundings")
# Mitsuba makes a mesh of its cube and two triangles of its rectangle; Radiance, Tachyon and Cycles get polygons.
# POV-Ray keeps box and polygon in their own space, and Embree's normals are the shapes' own.
# Over the default suite no stage of Mitsuba 3.9.1 leaves the limits derived for float32: nothing to allow for.
MITSUBA = "calibrated on Mitsuba 3.9.1: factor 1 at float32; normals from world-space corners"
# Its geometry is float64 with no more roundings than are counted; what it adds up in float32 it declares itself.
RADIANCE = "derived: float64 with the same counts of roundings; normals from world-space corners"
EMBREE = "derived: float32 decides what is hit; the values, continued in float64, are held to its counts"
POVRAY = "derived: float64 with the same counts of roundings; triangles' normals from baked float32 corners"
TACHYON = "derived: the scene is read as float32, what follows is float64; normals from float32 corners"
CYCLES = "calibrated on Cycles of Blender 5.0.1: factor 1 at float32; normals from world-space corners"
CALIBRATED: dict[str, Calibration] = {
    "mitsuba_scalar": Calibration(factor=1.0, origin=MITSUBA, baked_normals=True, placed_corners=True),
    "mitsuba_llvm": Calibration(factor=1.0, origin=MITSUBA, baked_normals=True, placed_corners=True),
    "cycles": Calibration(factor=1.0, origin=CYCLES, baked_normals=True, placed_corners=True),
    "embree": Calibration(factor=1.0, origin=EMBREE),
    "povray": Calibration(factor=1.0, origin=POVRAY, baked_normals=True),
    "radiance": Calibration(factor=1.0, origin=RADIANCE, baked_normals=True, placed_corners=True),
    "tachyon": Calibration(factor=1.0, origin=TACHYON, baked_normals=True, placed_corners=True),
}


def calibration(reference: str) -> Calibration:
    """Return a reference's constant; 1 where the limits are derived."""
    return CALIBRATED.get(reference, DERIVED)
