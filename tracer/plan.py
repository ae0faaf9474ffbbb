"""`Plan`: whether shapes are unrolled or in trees, the samples of a lane, and fused or split kernels.

Few primitives are unrolled: only skipping a formula is cheaper than a formula with constant numbers. In a large image a
lane takes several samples in a row, so that a test of which shapes they may hit costs little. More primitives are put
into trees, and a lane traverses them with a whole tile of samples. In a fused kernel the shadow rays of a tile traverse
the trees together as well, in tiles of fewer rows if triangles are nearly as small as pixels. In a small image, or for
a mesh with as many layers as hair, a second kernel traces shadow rays one by one.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from rayproof.cases.scene import Mesh, Scene, Shape
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import DeviceBuffers, KernelConstants
from rayproof.tracer.shapes.meshes import layers
from rayproof.tracer.shapes.primitives import traced

HANDFUL = 8  # shapes of one kind that are unrolled; measured in docs/developers.md
SEVERAL = 24  # the most shapes that are unrolled if a lane takes several samples and skips shapes that these cannot hit
FEW = 2**17  # samples below which a long kernel takes longer to compile than it saves
MANY = 2**20  # the least number of samples for which a long kernel of several kinds of shapes pays
SIMPLE = 3  # shapes
# Samples in a row that a lane of a simple scene takes; measured against 1, 2, 4 and 16.
STRIP = {"float32": 8, "float64": 4}
SHORT = 4  # the same for other scenes, whose kernel would be long
SMALL = (
    1.0  # the least number of triangles per sample for which neighbours share too few of them for a tile of four rows
)
DUST = 2.5  # the same for a tile of more than two by two
# Above FINE triangles per sample, a fused kernel traverses the triangles' tree in one loop, in tiles of two rows.
# Meshes with more than CLOSED layers count as closed bodies.
FINE, CLOSED = 0.5, 1.5
# DUST in such a loop, for open sheets and for closed bodies: smaller in float64, whose numbers need twice the room.
FINE_DUST = {"float32": (7.5, 2.0), "float64": (2.5, 1.0)}
# Meshes with more than DEEP layers in their box are hair or dust: neighbouring samples see triangles at different
# depths, and the shadow rays of a tile would be traced in many groups. Layers are counted only for more than SCATTERED
# triangles per sample.
DEEP, SCATTERED = 5.0, 0.25
FINE_DEEP = {"float32": SCATTERED, "float64": SMALL}  # the least number for which their tree is traversed in one loop
# Parts are used only with the default formula, which has a bound for the distance of a hit from its triangle.
CUT = "triangle"
# A formula that needs the matrix itself gets it only if the shapes are unrolled.
PLACING = ("to_object", "world_normal")


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The choices for building a kernel."""

    columns: int = 1  # of the samples of a lane
    rows: int = 1  # of the samples of a lane
    split: bool = False  # whether hits are written to memory, and all later stages are a second kernel
    trees: frozenset[str] = frozenset()  # kinds of shapes that are in trees: "triangle", "sphere", "cube", "square"
    tables: bool = (
        False  # whether the data of the hit shape are read from a table rather than selected among all shapes
    )
    pipelined: bool = False  # whether the tree of triangles is traversed in a single loop, not in nested loops
    parts: bool = False  # whether long oblique triangles are split (early split clipping) in their tree

    def in_tree(self, shape: Shape) -> bool:
        """Return whether a shape is put into a tree."""
        return not traced(shape).single or traced(shape).slot in self.trees

    def trees_of(self, shapes: Iterable[Shape]) -> dict[str, list[tuple[int, Shape]]]:
        """Return the members of each tree, with their indices: triangles in one, other shapes by `TracedShape.tree`."""
        crowds: dict[str, list[tuple[int, Shape]]] = {}
        for index, shape in enumerate(shapes):
            if self.in_tree(shape):
                crowds.setdefault(traced(shape).tree, []).append((index, shape))
        return crowds

    @property
    def text(self) -> str:
        """Return the plan in one line."""
        tile = (
            f"{self.columns} x {self.rows} samples per lane" if self.columns * self.rows > 1 else "one sample per lane"
        )
        kernels = "hits and shading in kernels of their own" if self.split else "one kernel"
        kernels += ", one loop through the tree of triangles" if self.pipelined else ""
        trees = f"in trees: {', '.join(sorted(self.trees))}" if self.trees else "every shape unrolled"
        return f"{trees}; {tile}; {kernels}"


@dataclass(frozen=True, kw_only=True)
class Context:
    """A scene, the formulas and the plan by which it is traced, and the storage of its numbers."""

    scene: Scene
    configuration: Configuration
    types: ArrayTypes
    plan: Plan
    buffers: DeviceBuffers
    parameters: KernelConstants


def plan(scene: Scene, configuration: Configuration, *, samples: int = 1) -> Plan:
    """Return the plan for a scene with samples x samples points per pixel."""
    plain = all(configuration.formula(slot).default for slot in PLACING)
    counts = Counter(shape.slot for shape in map(traced, scene.shapes) if shape.single and not shape.endless)
    meshes = tuple(shape for shape in scene.shapes if isinstance(shape, Mesh))
    triangles = sum(len(mesh.faces) for mesh in meshes)
    count = scene.camera.width * scene.camera.height * samples * samples
    strip = count >= FEW and not triangles and len(scene.shapes) <= SEVERAL
    tables = plain and sum(counts.values()) > HANDFUL
    trees = {kind for kind, count in counts.items() if count > HANDFUL and (plain or kind == "triangle")}
    if triangles:
        trees.add("triangle")
    if strip or not trees:
        columns = STRIP[configuration.precision] if len(scene.shapes) <= SIMPLE else SHORT
        return Plan(columns=columns if strip else 1, tables=tables)
    bounded = bool(configuration.formula("segment").facts.get("bounded", False))
    covered = layers(meshes) if count >= FEW and triangles > SCATTERED * count else 0.0
    deep = covered > DEEP
    split = count < FEW or not bounded or deep
    fine, small = (FINE_DEEP[configuration.precision], SMALL) if deep else (FINE, FINE)
    pipelined = (deep or not split) and triangles > fine * count
    small, dust = (small, FINE_DUST[configuration.precision][covered > CLOSED]) if pipelined else (SMALL, DUST)
    # A kernel with several kinds of trees is long: compiling it for sixteen rays pays only for a large image.
    rows = 4 if count >= (FEW if len(trees) == 1 else MANY) and triangles <= small * count else 2
    columns = 4 if count >= FEW and triangles <= dust * count else 2  # four in a row are written at once
    return Plan(
        columns=columns,
        rows=rows,
        split=split,
        trees=frozenset(trees),
        tables=tables,
        pipelined=pipelined,
        parts="triangle" in trees and configuration.formula(CUT).default,
    )
