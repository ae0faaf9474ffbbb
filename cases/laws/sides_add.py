"""What a two-sided surface shows is what its front and its back show."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import placed, rewound, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import scaling
from rayproof.cases.relations import Ask, Relation, added
from rayproof.cases.scene import Mesh, Plane, Scene, Shape, Square, Triangle
from rayproof.cases.stages import Stage

TURN = scaling(1, -1, -1)  # half a turn about x


def flat(shape: Shape) -> bool:
    """Say whether a shape can be turned over where it lies."""
    return isinstance(shape, Square | Plane | Triangle | Mesh)


def turned_over(shape: Shape) -> Shape:
    """Return a flat shape with its back to the front."""
    return placed(shape, TURN) if isinstance(shape, Square | Plane) else rewound(shape)


@LAWS.register("sides_add", stage=Stage.RADIANCE, implicates=("RAD-2", "RAD-4", "NRM-3"))
def sides_add(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Add the image of all flat shapes' fronts to that of their backs: it is the image of both sides.

    Proof: whoever sees one side does not see the other, of which the radiance is 0; what blocks light is the same.
    Round shapes are black in all three. Source: specification, `two_sided` and E12.
    """
    if not any(flat(shape) for shape in scene.shapes) or not scene.lights:
        return

    def prepared(shape: Shape) -> Shape:
        one_sided = replace(shape, two_sided=False)
        return one_sided if flat(shape) else replace(one_sided, albedo=(0.0, 0.0, 0.0))

    front = with_shapes(scene, prepared)
    back = with_shapes(front, lambda shape: turned_over(shape) if flat(shape) else shape)
    both = with_shapes(front, lambda shape: replace(shape, two_sided=flat(shape)))
    for relation in added(ask, (front, back), both, what="fronts and backs of flat shapes"):
        if relation.stage is Stage.RADIANCE:  # irradiance does not depend on who looks at which side
            yield relation
