"""The tree finds what trying every triangle finds, for every registered triangle formula."""

from typing import Any

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.scene import Mesh
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.kernel.parameters import DeviceBuffers
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.meshes import TriangleArrays
from rayproof.tracer.trees.beams import Beam
from rayproof.tracer.trees.traversal import NONE, Walk, any_hit, nearest
from rayproof.tracer.trees.trees import HostTriangleHierarchy, TriangleHierarchy, host_forest

TRIANGLES = [formula for formula in FORMULAS.variants("triangle") if formula.kind == "right"]


def soup(count: int, *, seed: int = 5, flat: bool = False) -> np.ndarray:
    """Return random triangles (count, 3, 3) in a box of about 4 m; `flat` ones all lie in z = 0.25."""
    generator = np.random.default_rng(seed)
    corners = generator.uniform(-2, 2, (count, 1, 3)) + generator.normal(size=(count, 3, 3)) * 0.5
    if flat:
        corners[..., 2] = 0.25
    return corners.astype(np.float32)


def mesh(corners: np.ndarray) -> Mesh:
    return Mesh(
        albedo=(0.5, 0.5, 0.5), vertices=corners.reshape(-1, 3), faces=np.arange(3 * len(corners)).reshape(-1, 3)
    )


def host(corners: np.ndarray) -> HostTriangleHierarchy:
    forest = host_forest(((0, mesh(corners)),))
    assert forest is not None
    return forest


def forest(corners: np.ndarray, types: ArrayTypes) -> TriangleHierarchy:
    return TriangleHierarchy(host(corners), types, DeviceBuffers())


def single(ray: Ray, hierarchy: TriangleHierarchy, formula: Any, interval: Interval) -> Walk:
    """Return what every ray by itself needs on its way."""
    return Walk(
        hierarchy=hierarchy,
        beam=Beam(hierarchy.nodes, ray.origin, [ray.direction]),
        meet=lambda triangle, k: formula(ray, triangle, interval),
    )


def first_hit(walk: Walk) -> tuple[np.ndarray, np.ndarray]:
    closer = FORMULAS["nearest/smaller"].function
    ((t, number),) = nearest(walk, closer=closer, limits=[walk.hierarchy.types.Float(dr.inf)], width=600)
    return np.array(t), np.where(np.isfinite(np.array(t)), np.array(number), NONE)


def met(walk: Walk, *, skips: Any = None, active: Any = None) -> np.ndarray:
    types = walk.hierarchy.types
    Single: Any = dr.float32_array_t(types.Float)
    asked = types.Bool(True) if active is None else active
    (found,) = any_hit(walk, farthest=Single(dr.inf), skips=skips, active=[asked], width=600)
    return np.isfinite(np.array(found))


def bundle(types: ArrayTypes, count: int = 600) -> Ray:
    """Return rays from all around, some along an axis and some in the plane of a box's face."""
    generator = np.random.default_rng(9)
    origins = generator.normal(size=(count, 3)) * 3
    directions = generator.uniform(-1.5, 1.5, (count, 3)) - origins
    directions[:100, 0] = 0.0
    directions[50:150, 1] = -0.0
    directions[20:30, :2] = 0.0
    kind = np.float64 if types.precision == "float64" else np.float32
    return Ray(origin=types.Vector(origins.T.astype(kind)), direction=types.Vector(directions.T.astype(kind)))


def everything_tried(corners: np.ndarray, ray: Ray, interval: Interval, formula: Any, types: ArrayTypes) -> Any:
    """Return t and number of the nearest of all triangles, every ray tried with each; at a tie the first."""
    count, rays = len(corners), dr.width(ray.direction)
    # One kernel tries all pairs: a triangle's corners as literals would make one for each triangle.
    rows = np.repeat(corners.astype(np.float64 if types.precision == "float64" else np.float32), rays, axis=0)
    lane = dr.tile(dr.arange(types.UInt, rays), count)
    every = Ray(
        origin=dr.gather(types.Vector, ray.origin, lane), direction=dr.gather(types.Vector, ray.direction, lane)
    )
    first, second, third = (types.Vector(rows[:, corner].T) for corner in range(3))
    found = np.array(formula(every, TriangleArrays(first=first, second=second, third=third), interval))
    found = found.reshape(count, rays)
    best = found.min(axis=0)
    return best, np.where(np.isfinite(best), found.argmin(axis=0), NONE)


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("formula", TRIANGLES, ids=lambda formula: formula.name)
@pytest.mark.parametrize(("count", "flat"), [(1, False), (2, False), (3, False), (37, False), (60, True)])
def test_the_tree_and_trying_everything_agree(formula: Any, count: int, flat: bool, precision: str) -> None:
    types = array_types(precision)
    corners, ray = soup(count, flat=flat), bundle(types)
    interval = Interval(nearest=types.Float(0.5), farthest=types.Float(1.5))
    walk = single(ray, forest(corners, types), formula.function, interval)

    t, number = first_hit(walk)
    found = met(walk)
    expected, which = everything_tried(corners, ray, interval, formula.function, types)

    assert np.isfinite(expected).any()
    if flat:
        # Overlapping triangles of one plane tie up to rounding, and the tree need not look at all of them.
        np.testing.assert_allclose(t, expected, rtol=1e-4 if precision == "float32" else 1e-12)
    else:
        np.testing.assert_array_equal(t, expected)
        np.testing.assert_array_equal(number, which)
    np.testing.assert_array_equal(found, np.isfinite(expected))


@pytest.mark.usefixtures("each_builder")
def test_of_equal_triangles_the_first_is_named() -> None:
    types = array_types("float32")
    corners = np.repeat(soup(6), 4, axis=0)[::-1].copy()
    ray, interval = bundle(types), Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))
    formula = FORMULAS["triangle/moeller_trumbore"].function

    _, number = first_hit(single(ray, forest(corners, types), formula, interval))
    _, which = everything_tried(corners, ray, interval, formula, types)

    np.testing.assert_array_equal(number, which)
    assert set(which[which != NONE] % 4) == {0}


def test_a_skipped_shape_is_not_met() -> None:
    types = array_types("float32")
    two = host_forest(((0, mesh(soup(20))), (3, mesh(soup(20, seed=6)))))
    assert two is not None
    both = TriangleHierarchy(two, types, DeviceBuffers())
    ray, interval = bundle(types), Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))
    formula = FORMULAS["triangle/moeller_trumbore"].function

    rest = met(single(ray, both, formula, interval), skips=lambda number, k: both.shape(number, types.Bool(True)) == 3)

    np.testing.assert_array_equal(rest, met(single(ray, forest(soup(20), types), formula, interval)))


def test_degenerate_triangles_are_left_out() -> None:
    corners = soup(5)
    corners[2, 2] = corners[2, 1]
    corners[3] = np.outer((1, 2, 4), (0.5, 0.25, 0.125))

    kept = host(corners)

    assert kept.faces.tolist() == [0, 1, 4]
    assert host_forest(((0, mesh(corners[2:3])),)) is None
