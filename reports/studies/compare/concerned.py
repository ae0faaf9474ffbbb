"""Which shapes of a scene a slot's formula has anything to do with."""

from collections.abc import Sequence

from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

KINDS: dict[str, tuple[type[Shape], ...]] = {
    "sphere": (Sphere,),
    "sphere_normal": (Sphere,),
    "cube": (Cube,),
    "cube_normal": (Cube,),
    "plane": (Plane,),
    "square": (Square,),
    "triangle": (Triangle, Mesh),
}
PLACED = ("to_object", "world_normal")  # of no use where object space is world space


def concerned(scene: Scene, slots: Sequence[str]) -> frozenset[int] | None:
    """Return the indices of the shapes that a change of `slots` can touch, None for all of them.

    Pixels that show other shapes are equal by construction; counted, they would bury every difference.
    """
    if not slots or any(slot not in KINDS and slot not in PLACED for slot in slots):
        return None
    return frozenset(
        index
        for index, shape in enumerate(scene.shapes)
        for slot in slots
        if (shape.to_world != IDENTITY if slot in PLACED else isinstance(shape, KINDS[slot]))
    )
