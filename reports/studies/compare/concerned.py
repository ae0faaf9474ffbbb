"""Which shapes of a scene a slot's formula has anything to do with."""

from collections.abc import Sequence

from rayproof.cases.scene import IDENTITY, Scene
from rayproof.tracer.formulas import PLACED, SHAPES_OF


def concerned(scene: Scene, slots: Sequence[str]) -> frozenset[int] | None:
    """Return the indices of the shapes that a change of `slots` can touch, None for all of them.

    Pixels that show other shapes are equal by construction; counted, they would bury every difference.
    """
    if not slots or any(slot not in SHAPES_OF and slot not in PLACED for slot in slots):
        return None
    return frozenset(
        index
        for index, shape in enumerate(scene.shapes)
        for slot in slots
        if (shape.to_world != IDENTITY if slot in PLACED else isinstance(shape, SHAPES_OF[slot]))
    )
