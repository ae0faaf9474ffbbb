"""The tracer's execution paths, each with what says of a rendering whether it takes it.

A path is code that one scene, configuration or way of asking runs through and another does not. They are declared here
so that `tests.harness.paths` can count which of them a suite of cases meets; nothing in the tracer reads this.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene, Shape
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import PACKETS
from rayproof.tracer.kernel.arrays import backend
from rayproof.tracer.light_path.camera_stage import is_narrow
from rayproof.tracer.light_path.illumination import MANY
from rayproof.tracer.plan import Plan
from rayproof.tracer.shapes.meshes import baked, degenerate
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.trees.build import PIECE, in_parts, slanting
from rayproof.tracer.trees.trees import bounds

STAGES, NUMBERS, FRAMES = "stages", "numbers", "frames"


@dataclass(frozen=True, kw_only=True)
class Rendering:
    """One call of the tracer: what decides which paths it takes."""

    scene: Scene
    configuration: Configuration
    plan: Plan
    route: str  # STAGES, NUMBERS or FRAMES
    samples: int = 1  # across a pixel

    @property
    def trees(self) -> dict[str, tuple[Shape, ...]]:
        """Return the members of each tree: triangles in one, other shapes by kind, sheared squares by themselves."""
        found = self.plan.trees_of(self.scene.shapes)
        return {name: tuple(shape for _, shape in members) for name, members in found.items()}

    @property
    def counts(self) -> tuple[int, ...]:
        """Return how many items each tree holds."""
        counts = {name: len(tree) for name, tree in self.trees.items()}
        if "triangle" in counts:
            counts["triangle"] = self._parts or sum(int((~degenerate(shape)).sum()) for shape in _triangles(self))
        return tuple(counts.values())

    @property
    def in_parts(self) -> bool:
        """Say whether triangles stand in their tree in parts."""
        return self._parts > 0

    @property
    def _parts(self) -> int:
        """Return how many parts triangles are cut into, 0 where they stay whole."""
        triangles = _triangles(self)
        if not self.plan.parts or not triangles:
            return 0
        corners = np.concatenate([baked(shape)[~degenerate(shape)] for shape in triangles])
        return len(in_parts(corners, *bounds(corners))[2]) if slanting(corners) else 0

    @property
    def unrolled(self) -> bool:
        """Say whether a shape has a formula of its own in the kernel."""
        return any(not self.plan.in_tree(shape) for shape in self.scene.shapes)

    @property
    def lit(self) -> bool:
        """Say whether there is light, and something to light."""
        return bool(self.scene.lights and self.scene.shapes)

    @property
    def blockers(self) -> bool:
        """Say whether anything may stand before a light."""
        return self.lit and (
            len(self.scene.shapes) > 1 or any(traced(shape).can_shadow_itself for shape in self.scene.shapes)
        )

    @property
    def tile(self) -> tuple[int, int]:
        """Return the columns and rows of samples that a lane takes."""
        return self.plan.columns, self.plan.rows

    @property
    def together(self) -> bool:
        """Say whether a lane feels for light with all its samples at once."""
        return self.tile != (1, 1) and not self.plan.split


def _levels(count: int) -> int:
    """Return how often a tree's leaves can be halved."""
    return max(0, count - 1).bit_length()


def _kind(name: str, *, placed: bool | None = None) -> Callable[[Rendering], bool]:
    """Return whether there is a tree of that name, and of spheres whether one of them has a transform."""

    def meets(r: Rendering) -> bool:
        moved = [not traced(shape).transform.identity for shape in r.trees.get(name, ())]
        return bool(moved) and placed in (None, any(moved))

    return meets


def _triangles(r: Rendering) -> tuple[Shape, ...]:
    return r.trees.get("triangle", ())


def _bounded(r: Rendering) -> bool:
    """Return whether a shape that has an end is unrolled."""
    return any(not r.plan.in_tree(shape) and not traced(shape).endless for shape in r.scene.shapes)


def _narrow(r: Rendering) -> bool:
    return is_narrow(r.scene.camera, max(r.tile), per_side=r.samples if r.route != FRAMES else 1)


@dataclass(frozen=True, kw_only=True)
class Path:
    """A path: its name, what it is, and whether a rendering takes it."""

    name: str
    what: str
    met: Callable[[Rendering], bool]


def _path(name: str, what: str, met: Callable[[Rendering], bool]) -> Path:
    return Path(name=name, what=what, met=met)


def _plan(columns: int, rows: int, what: str) -> Path:
    def met(r: Rendering) -> bool:
        return r.tile == (columns, rows)

    return _path(f"plan/{columns} x {rows}", what, met)


PATHS: tuple[Path, ...] = (
    _path("route/stages", "several stages, in kernels of their own", lambda r: r.route == STAGES),
    _path(
        "route/numbers", "one stage in one kernel, numbers in memory", lambda r: r.route == NUMBERS and r.samples == 1
    ),
    _path("route/samples", "several samples a pixel, side by side", lambda r: r.route == NUMBERS and r.samples > 1),
    _path("route/frames", "one frozen kernel", lambda r: r.route == FRAMES and r.samples == 1),
    _path(
        "route/frames of samples", "samples in a loop of a frozen kernel", lambda r: r.route == FRAMES and r.samples > 1
    ),
    _path(
        "frames/packets",
        "neighbours of a lane are written at once",
        lambda r: r.route == FRAMES and any(r.tile[0] % n == 0 and r.scene.camera.width % n == 0 for n in PACKETS),
    ),
    _path("numbers/literals", "the scene's numbers are part of the code", lambda r: r.route == FRAMES),
    _path("plan/one sample", "a lane takes one sample", lambda r: r.tile == (1, 1)),
    _plan(8, 1, "a lane takes eight samples in a row"),
    _plan(4, 1, "a lane takes four samples in a row"),
    _plan(4, 4, "a lane takes sixteen samples"),
    _plan(4, 2, "a lane takes eight samples in two rows"),
    _plan(2, 2, "a lane takes four samples in two rows"),
    _path("plan/hits through memory", "hits in trees are a kernel of their own", lambda r: r.plan.split),
    _path("trees/triangles", "triangles in a tree", lambda r: bool(_triangles(r))),
    _path("trees/spheres", "spheres in a tree, all as they are", _kind("sphere", placed=False)),
    _path("trees/ellipsoids", "spheres in a tree, with transforms", _kind("sphere", placed=True)),
    _path("trees/cubes", "cubes in a tree", _kind("cube")),
    _path("trees/squares", "squares in a tree", _kind("square")),
    _path("trees/sheared squares", "squares whose sides are not at right angles, in a tree", _kind("sheared square")),
    _path(
        "trees/several",
        "several trees, of triangles and of other shapes",
        lambda r: len(r.trees) > 1 and bool(_triangles(r)),
    ),
    _path("trees/several meshes", "several meshes in one tree", lambda r: len(_triangles(r)) > 1),
    _path(
        "trees/faces left out",
        "a mesh without its degenerate faces",
        lambda r: (
            len(_triangles(r)) == 1 and any(degenerate(one).any() for one in _triangles(r) if not traced(one).single)
        ),
    ),
    _path("trees/in parts", "long slanting triangles in parts, a box for each", lambda r: r.in_parts),
    _path(
        "trees/one loop",
        "one loop through the tree of triangles, not one in another",
        lambda r: r.plan.pipelined and bool(_triangles(r)),
    ),
    _path("trees/a single leaf", "one item in a tree", lambda r: 1 in r.counts),
    _path("trees/one root", "an even number of levels", lambda r: any(n > 1 and _levels(n) % 2 == 0 for n in r.counts)),
    _path("trees/two roots", "an odd number of levels", lambda r: any(n > 1 and _levels(n) % 2 for n in r.counts)),
    _path("builder/at once", "a tree that is built in one piece", lambda r: any(n <= PIECE for n in r.counts)),
    _path("builder/in pieces", "a larger tree, cut into pieces first", lambda r: any(n > PIECE for n in r.counts)),
    _path("shear/together", "rays of a tile turn as the middle one", lambda r: bool(_triangles(r)) and _narrow(r)),
    _path("shear/each by itself", "each ray turns by itself", lambda r: bool(_triangles(r)) and not _narrow(r)),
    _path(
        "cones/from the eye",
        "packets go past shapes that their cone shows they miss",
        lambda r: r.together and _bounded(r),
    ),
    _path(
        "cones/from a light",
        "shadow rays go past shapes likewise",
        lambda r: r.together and r.blockers and 0 < len(r.scene.lights) <= MANY and _bounded(r),
    ),
    _path(
        "cones/planes",
        "shadow rays go past planes that they lead away from",
        lambda r: (
            r.together
            and r.blockers
            and 0 < len(r.scene.lights) <= MANY
            and any(traced(s).endless for s in r.scene.shapes)
        ),
    ),
    _path("tables/chosen", "what belongs to a shape is chosen among all", lambda r: r.unrolled and not r.plan.tables),
    _path("tables/looked up", "what belongs to a shape is looked up", lambda r: r.plan.tables),
    _path("lights/none", "no light, or nothing to light", lambda r: not r.lit),
    _path("lights/unrolled", "each light is code of its own", lambda r: r.lit and len(r.scene.lights) <= MANY),
    _path("lights/in turn", "lights are a loop of the kernel", lambda r: r.lit and len(r.scene.lights) > MANY),
    _path("shadow_rays/none", "nothing can stand before a light", lambda r: r.lit and not r.blockers),
    _path(
        "shadow_rays/of a lone body", "a body may shade itself alone", lambda r: r.blockers and len(r.scene.shapes) == 1
    ),
    _path(
        "shadow_rays/one by one",
        "shadow rays go through trees one by one",
        lambda r: r.blockers and bool(r.trees) and not r.together,
    ),
    _path(
        "shadow_rays/in groups",
        "shadow_rays of a tile go through trees in groups",
        lambda r: r.blockers and bool(r.trees) and r.together,
    ),
    _path("precision/float32", "single precision", lambda r: r.configuration.precision == "float32"),
    _path("precision/float64", "double precision", lambda r: r.configuration.precision == "float64"),
    _path("backend/llvm", "LLVM, on the processor", lambda r: backend() == "llvm"),
    _path("backend/cuda", "CUDA, on a graphics card", lambda r: backend() == "cuda"),
)
