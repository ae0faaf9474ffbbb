"""`Case` and its expectations beyond the references (`Flux`, `PixelValue`, ...); `covering`: items of a scene."""

from dataclasses import dataclass

from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

# Every item of the specification, in its order.
ITEMS: tuple[str, ...] = (
    *(f"CAM-{n}" for n in range(1, 6)),
    *(f"XF-{n}" for n in range(1, 3)),
    *(f"HIT-{n}" for n in range(1, 10)),
    *(f"NRM-{n}" for n in range(1, 4)),
    *(f"LIT-{n}" for n in range(1, 6)),
    *(f"RAD-{n}" for n in range(1, 6)),
)  # fmt: skip

STORING = "IMG-1"  # how the image is stored: no formula, and part of every case
BLAMABLE: tuple[str, ...] = (*ITEMS, STORING)
RANDOM = "random"  # the family of scenes that are drawn; each is named random/SEED/NUMBER
# If the specification has two formulas, the one that another renderer uses is unknown: the first one is blamed.
SECOND_WAYS = frozenset({"CAM-5", "HIT-6", "HIT-8", "LIT-2", "LIT-3", "LIT-4", "LIT-5"})
ITEMS_OF_OTHERS = frozenset(ITEMS) - SECOND_WAYS


@dataclass(frozen=True, kw_only=True)
class PixelValue:
    """A closed form for one channel of one pixel."""

    stage: Stage
    column: int
    row: int
    channel: int
    value: float
    relative: float  # tolerance, relative to value
    because: str


@dataclass(frozen=True, kw_only=True)
class UniformValue:
    """A closed form that holds at every pixel that sees the shape."""

    stage: Stage
    shape: int
    channel: int
    value: float
    relative: float
    because: str


@dataclass(frozen=True, kw_only=True)
class Flux:
    """A closed form for the integral of irradiance over a rectangle seen frontally: sum of E times pixel footprint.

    A perspective image of a plane parallel to the image plane samples it on a uniform grid, so the sum is a midpoint
    rule; `relative` bounds its error.
    """

    shape: int
    face: int  # -1: every face
    channel: int
    footprint: float  # m^2 of the rectangle per pixel
    value: float  # W
    relative: float
    because: str


@dataclass(frozen=True, kw_only=True)
class ShadowOutline:
    """A closed form for a shadow's outline on a shape in a plane of constant world z.

    Pixels of `shape` whose hit is inside the outline must be dark for `light`, pixels outside must be lit; within
    `margin` of the outline both are right.
    """

    shape: int
    light: int
    form: str  # "square" (axis-aligned, half-size `size`) or "disc" (radius `size`)
    center: tuple[float, float]  # world x, y [m]
    size: float  # m
    margin: float  # m
    because: str


Expectation = PixelValue | UniformValue | Flux | ShadowOutline


# In 249 of the suite's 263 cases nearby problems explain at most 0.3 % of the pixels; the others set a larger share.
FEW_EXPLAINED = 0.01


@dataclass(frozen=True, kw_only=True)
class Case:
    """A scene, the reason for it, the items that it covers, and the number of its pixels that must be decidable.

    `covers` names exactly the specification items whose formula this scene exercises *validly*: a formula variant is
    run on the cases that cover its item (LIT-2, which loses self-shadowing, is not listed where self-shadowing
    matters).
    """

    name: str  # "family/case"; a case's own part may have slashes too
    scene: Scene
    stresses: str  # a sentence
    covers: tuple[str, ...]
    least_interior: int  # pixels that hit something and are within their limits; fewer is an error, not a pass
    most_explained: float = FEW_EXPLAINED  # largest share of pixels over their limits that nearby problems may explain
    samples: int = 1  # per side of a pixel; > 1 also compares box-filtered radiance
    expectations: tuple[Expectation, ...] = ()
    tuned: bool = True  # the two were fixed for this very scene; if not, a check of too few pixels is undecided

    def __post_init__(self) -> None:
        unknown = [item for item in self.covers if item not in ITEMS]
        if unknown or not self.covers:
            raise ValueError(f"case {self.name}: covers must name specification items, got {unknown or 'none'}")
        parts = self.name.split("/")
        if len(parts) < 2 or not all(part.strip(".") for part in parts):
            raise ValueError(f"case {self.name!r}: the name must read family/case")
        if not self.stresses.endswith("."):
            raise ValueError(f"case {self.name}: `stresses` must be a sentence")
        if not 0 <= self.most_explained < 1 or self.least_interior < 0 or self.samples < 1:
            raise ValueError(f"case {self.name}: least_interior >= 0, 0 <= most_explained < 1, samples >= 1")

    @property
    def family(self) -> str:
        """Return the part of the name before the first slash."""
        return self.name.split("/")[0]


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

    A family adds the items of alternative formulas by hand. Triangles and meshes are baked into world space before
    rendering, so their transforms exercise no XF item. A scene in which nothing can block a light needs no shadow ray:
    a single shape shadows itself only if it is a mesh, or a two-sided sphere or cube that is lit through its wall.
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
