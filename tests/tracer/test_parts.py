"""Triangles in parts: every point of a triangle is in a part's box, and rays meet what they meet without parts."""

from collections.abc import Iterator

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.scene import Mesh
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.kernel.parameters import DeviceBuffers
from rayproof.tracer.plan import plan
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.trees import build
from rayproof.tracer.trees.beams import Beam
from rayproof.tracer.trees.build import in_parts
from rayproof.tracer.trees.traversal import Walk, nearest
from rayproof.tracer.trees.trees import TriangleHierarchy, bounds, host_forest
from tests.tracer.scenes import scene
from tests.tracer.test_culling import vector

FORMULA = FORMULAS["triangle/woop_kahan"].function
CLOSER = FORMULAS["nearest/smaller"].function
LANES, PER_LANE = 512, 4


@pytest.fixture(autouse=True)
def anew() -> Iterator[None]:
    host_forest.cache_clear()
    yield
    host_forest.cache_clear()


def rods(count: int, *, seed: int, scale: float = 1.0, moved: float = 0.0) -> np.ndarray:
    """Return long thin triangles in all directions, rows of nine numbers."""
    generator = np.random.default_rng(seed)
    middle, along = generator.uniform(-1, 1, (count, 3)), generator.normal(size=(count, 3))
    across = generator.normal(size=(count, 3)) * 10.0 ** generator.uniform(-4, -1.5, (count, 1))
    corners = np.stack([middle - along, middle + along, middle + along + across], axis=1)
    # Some lie in a plane of two axes or along one, and some are the same as others.
    corners[: count // 8, :, 1] = corners[: count // 8, :1, 1]
    corners[count // 4 : count // 4 + 6] = corners[:6]
    return ((corners + moved) * scale).astype(np.float32).reshape(-1, 9)


def mesh(corners: np.ndarray) -> Mesh:
    return Mesh(
        albedo=(0.5, 0.5, 0.5), vertices=corners.reshape(-1, 3), faces=np.arange(3 * len(corners)).reshape(-1, 3)
    )


@pytest.mark.parametrize(("scale", "moved"), [(1.0, 0.0), (1e-6, 0.0), (1e15, 0.0), (1.0, 1e4)])
def test_every_point_of_a_triangle_is_in_the_box_of_one_of_its_parts(scale: float, moved: float) -> None:
    corners = rods(200, seed=1, scale=scale, moved=moved)
    generator = np.random.default_rng(2)

    lower, upper, owner = in_parts(corners, *bounds(corners))

    assert 2 * len(corners) < len(owner) <= build.MOST * len(corners)
    weights = generator.dirichlet((0.4, 0.4, 0.4), size=(len(corners), 50))
    points = np.einsum("npk,nka->nap", weights, corners.reshape(-1, 3, 3).astype(np.float64))
    rounding = 2.0**-50 * float(abs(corners).max())  # of the points themselves
    lower, upper = lower.astype(np.float64) - rounding, upper.astype(np.float64) + rounding
    for triangle, of_triangle in enumerate(points):
        mine = owner == triangle
        inside = (lower[:, mine, np.newaxis] <= of_triangle[:, np.newaxis]).all(axis=0)
        inside &= (of_triangle[:, np.newaxis] <= upper[:, mine, np.newaxis]).all(axis=0)
        assert inside.any(axis=0).all()


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_rays_meet_the_same_triangles_first_as_without_parts(precision: str) -> None:
    types = array_types(precision)
    everywhere = Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))
    met = 0
    for seed in range(6):
        generator = np.random.default_rng(seed)
        scale, moved = 10.0 ** generator.uniform(-4, 4), 10.0 ** generator.uniform(-2, 2)
        corners = rods(150, seed=seed, scale=scale, moved=moved)
        far = 10.0 ** generator.uniform(0, 2)
        origins = (generator.normal(size=(LANES, 3)) * 3 * far + moved) * scale
        # At points of triangles, half of them on an edge or at a corner.
        weights = generator.dirichlet((0.5, 0.5, 0.5), size=(LANES, PER_LANE))
        weights[::2, :, 0] = 0
        weights[::4, :, 1] = 0
        aimed = corners.reshape(-1, 3, 3)[generator.integers(len(corners), size=(LANES, PER_LANE))]
        targets = np.einsum("lkc,lkca->lka", weights / weights.sum(axis=-1, keepdims=True), aimed)
        # The rays of a lane start from one point.
        directions = targets - origins[:, np.newaxis]
        rays = [
            Ray(
                origin=vector(types, origins.astype(np.float32)),
                direction=vector(types, directions[:, k].astype(np.float32)),
            )
            for k in range(PER_LANE)
        ]

        answers = []
        for cut in (True, False):
            host = host_forest(((0, mesh(corners)),), parts=cut)
            assert host is not None
            assert (len(host.records) > 2 * len(corners)) is cut
            hierarchy = TriangleHierarchy(host, types, DeviceBuffers())
            walk = Walk(
                hierarchy=hierarchy,
                beam=Beam(hierarchy.nodes, rays[0].origin, [ray.direction for ray in rays]),
                meet=lambda triangle, k, rays=rays: FORMULA(rays[k], triangle, everywhere),
            )
            found = nearest(walk, closer=CLOSER, limits=[types.Float(dr.inf)] * PER_LANE, width=LANES)
            answers.append([(np.array(t), np.array(number)) for t, number in found])

        for (t, number), (expected, which) in zip(*answers, strict=True):
            np.testing.assert_array_equal(t, expected, err_msg=f"seed {seed}")
            hit = np.isfinite(expected)
            np.testing.assert_array_equal(number[hit], which[hit], err_msg=f"seed {seed}")
            met += hit.sum()
    assert met > 6 * LANES * PER_LANE * 0.3


def test_only_the_formula_whose_hits_are_known_to_lie_on_their_triangle_meets_parts() -> None:
    world = scene(mesh(rods(build.FEWEST, seed=4)))

    assert plan(world, Configuration()).parts
    assert not plan(world, Configuration(formulas={"triangle": "moeller_trumbore"})).parts
