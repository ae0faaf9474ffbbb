"""A sphere may be described by its centre and radius or by its matrix."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import placed, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, scaling, translation
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Scene, Shape, Sphere
from rayproof.cases.stages import Stage


def by_matrix(shape: Shape) -> Shape:
    """Return a sphere of another centre and radius, moved and scaled by its matrix to where it was."""
    if not isinstance(shape, Sphere):
        return shape
    center, radius = ((-0.4, 0.3, 0.7), 2.5) if shape.center == (0.0, 0.0, 0.0) else ((0.0, 0.0, 0.0), 1.0)
    unit = replace(shape, center=center, radius=radius)
    ratio = shape.radius / radius
    to_origin = translation(*(-x for x in center))
    return placed(unit, compose(translation(*shape.center), scaling(ratio, ratio, ratio), to_origin))


@LAWS.register("sphere_placed", stage=Stage.OBJECT, implicates=("HIT-1", "XF-1", "XF-2", "NRM-1", "NRM-3"))
def sphere_placed(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Write every sphere's centre and radius into its matrix, or part of its matrix into those: all stays.

    Proof: x -> c + r x carries the unit sphere onto the one about c of radius r. Source: specification, HIT-1 and XF-1.
    """
    if any(isinstance(shape, Sphere) for shape in scene.shapes):
        changed = with_shapes(scene, by_matrix)
        yield from related(ask, scene, changed, what="every sphere placed in another way")
