"""Planted faults of trees: their builders, their leaves, what stands in them, and how a tile goes through them."""

from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.tracer import light_path
from rayproof.tracer.kernel import arithmetic
from rayproof.tracer.light_path import surfaces
from rayproof.tracer.shapes.meshes import TracedMesh
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.trees import build, traversal
from rayproof.tracer.trees.boxes import Nodes
from rayproof.tracer.trees.trees import Hierarchies, TriangleHierarchy
from tests.harness.audit.faults.paths import function, method


def _without_last(tree: Any, count: int) -> Any:
    """Return a tree whose last item is the first one once more."""
    return replace(tree, slots=np.where(tree.slots == count - 1, 0, tree.slots).astype(tree.slots.dtype))


def _odd(right: Any, boxes: Any) -> Any:
    tree, count = right(boxes), len(boxes.rows)
    return _without_last(tree, count) if count % 2 and 1 < count <= build.PIECE else tree


def _thousand(right: Any, boxes: Any) -> Any:
    tree, count = right(boxes), len(boxes.rows)
    return _without_last(tree, count) if 1000 < count <= build.PIECE else tree


def _last_of_pieces(right: Any, boxes: Any) -> Any:
    tree, count = right(boxes), len(boxes.rows)
    return _without_last(tree, count) if count > build.PIECE else tree


def _part_lost(right: Any, corners: Any, lower: Any, upper: Any) -> Any:
    lower, upper, owner = right(corners, lower, upper)
    # Every eighth part is another one's once more.
    return lower, upper, np.where(np.arange(len(owner)) % 8 == 7, 0, owner).astype(owner.dtype)


def _first_ray_blind(right: Any, walk: Any, aim: Any, **about: Any) -> Any:
    first, *others = right(walk, aim, **about)
    return [first + dr.inf, *others]


def _no_leaf(right: Any, nodes: Any, leaf: Any) -> Any:
    return [] if nodes.host.leaves == 1 else right(nodes, leaf)


def _twice(halves: bool) -> Any:
    def read(right: Any, nodes: Any, node: Any) -> Any:
        words = right(nodes, node)
        if nodes.halves is not halves or nodes.host.leaves == 1:
            return words
        return [word & 0xFFFFFF | (word << 8) & 0xFF000000 for word in words[:6]] + words[6:]

    return read


def _packed(kind: str) -> Any:
    def packed(right: Any, shape: Any, *, identity: bool) -> Any:
        numbers = right(shape, identity=identity).copy()
        if kind == "spheres" and shape.tree == "sphere" and identity:
            numbers[3] *= 0.9
        elif kind == "ellipsoids" and shape.tree == "sphere" and not identity:
            numbers[:9] = shape.transform.inverse.T.reshape(-1)
        elif kind == f"{shape.tree}s" and kind != "spheres":
            numbers[:9] *= 1.1
        return numbers

    return packed


def _beside(right: Any, trees: Any, hierarchy: Any, before: Any, distance: Any, number: Any) -> Any:
    lost = hierarchy is not trees.forest and trees.forest is not None
    return before if lost else right(trees, hierarchy, before, distance, number)


def _first_shape(right: Any, forest: Any, number: Any, active: Any) -> Any:
    found = right(forest, number, active)
    return forest.types.Int(forest.host.members[0].index) if len(forest.host.members) > 1 else found


def _number_for_face(right: Any, forest: Any, number: Any, active: Any) -> Any:
    return forest.types.Int(number) if len(forest.host.members) == 1 else right(forest, number, active)


def _one_sided(right: Any, met: Any, normal: Any) -> Any:
    facing = right(met, normal)
    return dr.select(met.kind(TracedMesh), normal, facing) if met.world.trees.forest is not None else facing


def _apart(right: Any, trace: Any) -> Any:
    return [(distance * 1.001, item) for distance, item in right(trace)]


def _one_by_one(right: Any, walk: Any, **about: Any) -> Any:
    found = right(walk, **about)
    return [one + dr.inf for one in found] if len(found) == 1 else found


def _unparted(right: Any, types: Any, walk: Any, *, points: Any, active: Any, **about: Any) -> Any:
    if len(points) > 1:
        # Those that lie apart from the tile's first point are never felt for.
        near = [~(traversal._apart(point, points[0]) > 0.05) for point in points]
        active = [one & close for one, close in zip(active, near, strict=True)]
    return right(types, walk, points=points, active=active, **about)


def _sheared(together: bool) -> Any:
    def prepared(right: Any, rays: Any, *, together: bool = False, of: bool = together) -> Any:
        found = right(rays, together=together)
        if together is not of:
            return found
        return [replace(ray, shear=replace(ray.shear, Sz=ray.shear.Sz * 1.001)) for ray in found]

    return prepared


OVER, THOUSAND, NINE = "faces/over_two_to_the_16", "faces/thousand_and_25", "faces/nine"
MET = (Stage.DISTANCE, Stage.VISIBILITY)

function(
    "odd_count_last_item",
    build.tree_over,
    _odd,
    "A tree that is built at once loses the last of an odd number of items.",
    path="builder/at once",
    stage=Stage.OBJECT,
    also=MET,
    cases=(NINE, "faces/above_each_other"),
)
function(
    "last_of_a_thousand",
    build.tree_over,
    _thousand,
    "The last of more than 1000 items of a tree that is built at once is lost.",
    path="builder/at once",
    stage=Stage.OBJECT,
    also=MET,
    cases=(THOUSAND,),
)
function(
    "last_item_of_pieces",
    build.tree_over,
    _last_of_pieces,
    "A tree that is cut into pieces loses its last item.",
    path="builder/in pieces",
    stage=Stage.OBJECT,
    also=MET,
    cases=(OVER,),
)
function(
    "part_of_a_triangle",
    build.in_parts,
    _part_lost,
    "Every eighth part of long triangles is lost.",
    path="trees/in parts",
    stage=Stage.OBJECT,
    also=MET,
    cases=("meshes/slivers",),
)
function(
    "one_loop_first_ray",
    traversal._pipelined,
    _first_ray_blind,
    "Where one loop goes through a tree, the first ray of a lane meets nothing.",
    path="trees/one loop",
    stage=Stage.OBJECT,
    also=MET,
    cases=("alone/concave_mesh", "meshes/wavy_sheet_from_behind"),
    routes=("one loop",),
)
method(
    "single_leaf",
    Nodes,
    "slots",
    _no_leaf,
    "A tree of one leaf holds nothing.",
    path="trees/a single leaf",
    stage=Stage.OBJECT,
    also=MET,
    cases=("faces/one",),
)
method(
    "box_of_one_root",
    Nodes,
    "read",
    _twice(False),
    "Every fourth box of a tree with one root is its neighbour's.",
    path="trees/one root",
    stage=Stage.OBJECT,
    also=MET,
    cases=(NINE, OVER, THOUSAND, "meshes/*"),
)
method(
    "box_of_two_roots",
    Nodes,
    "read",
    _twice(True),
    "Every fourth box of a tree with two roots is its neighbour's.",
    path="trees/two roots",
    stage=Stage.OBJECT,
    also=MET,
    cases=("faces/above_each_other", THOUSAND, OVER, "meshes/*"),
)
for _kind, _case in (
    ("spheres", "crowds/spheres_beside_a_mesh"),
    ("ellipsoids", "crowds/ellipsoids"),
    ("cubes", "crowds/cubes"),
    ("squares", "crowds/squares"),
    ("sheared squares", "crowds/squares"),
):
    method(
        f"crowd_of_{_kind.replace(chr(32), chr(95))}",
        TracedShape,
        "packed",
        _packed(_kind),
        f"In a tree, {_kind} are not what they are elsewhere.",
        path=f"trees/{_kind}",
        stage=Stage.OBJECT,
        also=MET,
        cases=(_case,),
    )
method(
    "crowd_beside_a_mesh",
    Hierarchies,
    "nearer",
    _beside,
    "Whatever stands in a tree beside a mesh's is not seen.",
    path="trees/several",
    stage=Stage.OBJECT,
    also=MET,
    cases=("crowds/spheres_beside_a_mesh",),
)
method(
    "several_meshes_one_shape",
    TriangleHierarchy,
    "shape",
    _first_shape,
    "All triangles belong to the first mesh.",
    path="trees/several meshes",
    stage=Stage.OBJECT,
    cases=("crowds/triangles", "sidedness/mesh_*"),
)
method(
    "faces_left_out",
    TriangleHierarchy,
    "face",
    _number_for_face,
    "Faces are counted without the degenerate ones.",
    path="trees/faces left out",
    stage=Stage.OBJECT,
    cases=("meshes/degenerate",),
)
function(
    "mesh_one_sided",
    surfaces._facing,
    _one_sided,
    "No mesh turns its normals to the viewer.",
    path="trees/triangles",
    stage=Stage.NORMAL,
    cases=("meshes/wavy_sheet_from_behind",),
)
function(
    "hits_through_memory",
    light_path._met_apart,
    _apart,
    "What goes through memory comes back a thousandth farther away.",
    path="plan/hits through memory",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT,),
    cases=(NINE, "meshes/torus"),
)
function(
    "shadow_rays_one_by_one",
    traversal.any_hit,
    _one_by_one,
    "A shadow ray that goes through a tree by itself meets nothing.",
    path="shadow_rays/one by one",
    stage=Stage.VISIBILITY,
    cases=("meshes/torus", "alone/concave_mesh"),
)
function(
    "shadow_rays_that_part",
    traversal.any_hit_in_groups,
    _unparted,
    "Shadow rays that part from a tile's first are lost.",
    path="shadow_rays/in groups",
    stage=Stage.VISIBILITY,
    cases=("alone/concave_mesh", "crowds/cubes", "crowds/squares"),
    routes=("tiles of 4 x 4", "tiles of 4 x 2", "tiles of 2 x 2"),
)
function(
    "shear_together",
    arithmetic.prepared,
    _sheared(True),
    "Rays that turn alike in the shear are stretched.",
    path="shear/together",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT, Stage.VISIBILITY),
    cases=(NINE, "meshes/torus"),
)
function(
    "shear_each",
    arithmetic.prepared,
    _sheared(False),
    "Rays that turn by themselves in the shear are stretched.",
    path="shear/each by itself",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT, Stage.VISIBILITY),
    cases=("meshes/wavy_sheet_from_behind", "alone/concave_mesh"),
)
