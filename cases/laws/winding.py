"""Of a two-sided triangle it does not matter which way it is wound."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.changes import has_triangles, rewound, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Mesh, Scene, Shape, Triangle
from rayproof.cases.stages import Stage


def two_sided(shape: Shape) -> Shape:
    """Return triangles and meshes with two sides."""
    return replace(shape, two_sided=True) if isinstance(shape, Triangle | Mesh) else shape


@LAWS.register("winding", stage=Stage.NORMAL, implicates=("HIT-5", "HIT-6", "NRM-3"))
def winding(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Wind every triangle, all of them two-sided, the other way: nothing changes.

    Proof: nothing is culled, and a two-sided surface's normal is turned towards the viewer whichever way it pointed.
    Source: specification, `two_sided` and E12.
    """
    if has_triangles(scene):
        first = with_shapes(scene, two_sided)
        yield from related(ask, first, with_shapes(first, rewound), what="two-sided triangles wound the other way")
