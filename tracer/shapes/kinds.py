"""All kinds of shapes that the tracer knows, and the plane, of which there is nothing else to say."""

from dataclasses import dataclass

from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.cube import TracedCube
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.shapes.sphere import TracedSphere
from rayproof.tracer.shapes.square import TracedSquare
from rayproof.tracer.shapes.triangles import TracedMesh, TracedTriangle


@dataclass(frozen=True, kw_only=True)
class PlaneArrays:
    """The plane z = 0 of object space."""


@dataclass(frozen=True)
class TracedPlane(TracedShape):
    """The plane z = 0 of object space."""

    slot, endless = "plane", True

    def arrays(self, types: ArrayTypes) -> PlaneArrays:
        """Return the plane."""
        return PlaneArrays()


KINDS: dict[type[Shape], type[TracedShape]] = {
    Sphere: TracedSphere,
    Cube: TracedCube,
    Plane: TracedPlane,
    Square: TracedSquare,
    Triangle: TracedTriangle,
    Mesh: TracedMesh,
}


def traced(shape: Shape) -> TracedShape:
    """Return what the tracer knows of a shape.

    Raises:
        LookupError: it knows no such kind; the message lists those that it does.

    """
    if type(shape) not in KINDS:
        known = ", ".join(kind.__name__ for kind in KINDS)
        raise LookupError(f"no formula intersects a {type(shape).__name__}; known: {known}")
    return KINDS[type(shape)](shape)
