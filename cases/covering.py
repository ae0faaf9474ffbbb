"""Which specification items a scene exercises with the default formulas; a family adds the alternatives by hand."""

from rayproof.cases.case import ITEMS
from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

HIT_ITEMS: tuple[tuple[type[Shape], str], ...] = (
    (Sphere, "HIT-1"),
    (Cube, "HIT-3"),
    (Plane, "HIT-4"),
    (Triangle, "HIT-6"),
    (Mesh, "HIT-6"),
    (Square, "HIT-7"),
)
SOLID = (Sphere, Cube)


def covering(scene: Scene, *more: str) -> tuple[str, ...]:
    """Return the items that the default formulas exercise on `scene`, and `more`, in the specification's order.

    Triangles and meshes are baked into world space before rendering, so their transforms exercise no XF item. A
    scene where nothing can block a light needs no feeler: alone, only a mesh shadows itself, or a two-sided sphere or
    cube that is lit through its wall.
    """
    shapes = scene.shapes
    items = {"CAM-1", "CAM-2", "CAM-3", "CAM-4", *more}
    items.update(item for kind, item in HIT_ITEMS if any(isinstance(shape, kind) for shape in shapes))
    if len(shapes) > 1:
        items.add("HIT-9")
    if any(isinstance(shape, Sphere) for shape in shapes):
        items.add("NRM-1")
    if any(isinstance(shape, Cube) for shape in shapes):
        items.add("NRM-2")
    if any(shape.to_world != IDENTITY and not isinstance(shape, (Triangle, Mesh)) for shape in shapes):
        items.update(("XF-1", "XF-2", "NRM-3"))
    if scene.lights:
        shades_itself = (isinstance(shape, Mesh) or (isinstance(shape, SOLID) and shape.two_sided) for shape in shapes)
        if len(shapes) > 1 or any(shades_itself):
            items.update(("LIT-1", "LIT-5"))
        items.update(("RAD-3",) if scene.shading == "simplified" else ("RAD-1", "RAD-2", "RAD-4"))
    return tuple(item for item in ITEMS if item in items) + tuple(item for item in items if item not in ITEMS)
