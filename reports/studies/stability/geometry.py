"""What an intersection formula is given on the device: a ladder's columns as the tracer's records."""

from typing import Any

from rayproof.reports.studies.stability.exactly import Columns
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.meshes import TriangleArrays
from rayproof.tracer.shapes.primitives import CubeArrays, PlaneArrays, SphereArrays, SquareArrays


def record(shape: str, columns: Columns, types: ArrayTypes) -> Any:
    """Return the device record of one shape per ray; cube, plane and square are the unit ones."""
    match shape:
        case "sphere":
            return SphereArrays(center=columns["c"], radius=columns["r"])
        case "triangle":
            return TriangleArrays(first=columns["a"], second=columns["b"], third=columns["c"])
        case "cube":
            return CubeArrays()
        case "plane":
            return PlaneArrays()
        case _:
            return SquareArrays(
                center=types.Vector(0.0, 0.0, 0.0),
                half_width=types.Vector(0.5, 0.0, 0.0),
                half_height=types.Vector(0.0, 0.5, 0.0),
                orthogonal=True,
            )


def ray_of(columns: Columns) -> Ray:
    """Return the ray of the columns o and d."""
    return Ray(origin=columns["o"], direction=columns["d"])


def ahead(types: ArrayTypes) -> Interval:
    """Return the interval of everything in front of the ray's origin."""
    return Interval(nearest=types.Float(0.0), farthest=types.Float(float("inf")))
