"""Going through the tree loses no hit: bundles of rays against trying every triangle, and rays at edges and corners.

Half of it goes by one loop, half by a loop in a loop.
"""

import zlib
from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.scene import Mesh
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.kernel.arithmetic import prepared, turning_alike, turns
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.kernel.parameters import DeviceBuffers
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.trees.beams import Beam
from rayproof.tracer.trees.traversal import WIDER, Walk, any_hit, any_hit_in_groups, nearest
from rayproof.tracer.trees.trees import TriangleHierarchy, host_forest

TRIANGLES = 28  # in a tree of 32 leaves, the same kernel for every scene
LANES, PER_LANE = 64, 4
SCENES = 70  # for each builder in each precision: 420 scenes in all
FORMULA = FORMULAS["triangle/woop_kahan"].function
CLOSER = FORMULAS["nearest/smaller"].function

pytestmark = pytest.mark.usefixtures("each_builder")


def grown(corners: np.ndarray, types: ArrayTypes) -> TriangleHierarchy:
    mesh = Mesh(
        albedo=(0.5, 0.5, 0.5), vertices=corners.reshape(-1, 3), faces=np.arange(3 * len(corners)).reshape(-1, 3)
    )
    host = host_forest(((0, mesh),))
    assert host is not None
    return TriangleHierarchy(host, types, DeviceBuffers())


def scene(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return triangles, origins (lanes, 3) and directions (lanes, rays, 3), at any scale and anywhere.

    Bundles are narrow or wide, and some of their rays run along an axis or in a plane of two.
    """
    generator = np.random.default_rng(seed)
    scale, moved = 10.0 ** generator.uniform(-4, 4), generator.normal(size=3) * 10.0 ** generator.uniform(-2, 3)
    corners = generator.uniform(-2, 2, (TRIANGLES, 1, 3)) + generator.normal(size=(TRIANGLES, 3, 3)) * 0.4
    corners[: seed % 9, :, seed % 3] = 0.25
    origins = generator.normal(size=(LANES, 3)) * 3
    targets = corners[generator.integers(TRIANGLES, size=LANES)].mean(axis=1)[:, np.newaxis]
    width = 10.0 ** generator.uniform(-4, 0, (LANES, 1, 1))
    directions = targets + width * generator.normal(size=(LANES, PER_LANE, 3)) - origins[:, np.newaxis]
    directions[:10, :, 0], directions[8:16, :2, 1], directions[14:20, :, 1:] = 0.0, -0.0, 0.0
    return tuple(
        x.astype(np.float32) for x in ((corners + moved) * scale, (origins + moved) * scale, directions * scale)
    )


def vector(types: ArrayTypes, values: np.ndarray) -> Any:
    kind = np.float64 if types.precision == "float64" else np.float32
    return types.Vector(np.ascontiguousarray(values.T, dtype=kind))


def tried(forest: TriangleHierarchy, rays: Sequence[Ray], interval: Interval, width: int) -> list[np.ndarray]:
    """Return, per ray, the smallest t over all triangles, one after the other."""
    types = forest.types
    state = (types.UInt(0), [dr.full(types.Float, dr.inf, width) for _ in rays])

    def step(slot: Any, bests: Any) -> tuple[Any, Any]:
        triangle, _ = forest.item(slot)
        found = [FORMULA(ray, triangle, interval) for ray in rays]
        return slot + 1, [dr.select(t < best, t, best) for t, best in zip(found, bests, strict=True)]

    count = dr.opaque(types.UInt, len(forest.host.records))
    _, bests = dr.while_loop(state=state, cond=lambda slot, bests: slot < count, body=step)
    return [np.array(best) for best in bests]


def from_the_light(
    forest: TriangleHierarchy, shadow_rays: Sequence[Ray], eye: Any, segment: Interval
) -> Callable[[Any, Any], Any]:
    """Return the way of a group of shadow rays and the t of its end, from the group and its turn."""
    Single: Any = dr.float32_array_t(forest.types.Float)

    def walk(active: Any, turn: Any) -> tuple[Walk, Any]:
        beam = Beam(forest.nodes, eye, [shadow_ray.origin - eye for shadow_ray in shadow_rays], active=active)
        alike = turning_alike(shadow_rays, turn)
        way = Walk(hierarchy=forest, beam=beam, meet=lambda triangle, k: FORMULA(alike[k], triangle, segment))
        return way, Single(WIDER)

    return walk


def test_bundles_lose_no_hit_on_random_scenes(precision: str, request: pytest.FixtureRequest) -> None:
    types = array_types(precision)
    Single: Any = dr.float32_array_t(types.Float)
    everywhere = Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))
    segment = Interval(nearest=types.Float(0), farthest=types.Float(1))
    hits = 0
    first = zlib.crc32(request.node.name.encode())  # scenes of its own for each builder and precision
    for seed in range(first, first + SCENES):
        corners, origins, directions = scene(seed)
        forest = grown(corners, types)
        rays = [Ray(origin=vector(types, origins), direction=vector(types, directions[:, k])) for k in range(PER_LANE)]
        # As shadow rays: from the ends of the rays back to their common origin.
        ends = [origins + directions[:, k] for k in range(PER_LANE)]
        shadow_rays = [Ray(origin=vector(types, end), direction=vector(types, origins - end)) for end in ends]

        walk = Walk(
            hierarchy=forest,
            beam=Beam(forest.nodes, rays[0].origin, [ray.direction for ray in rays]),
            meet=lambda triangle, k, rays=rays: FORMULA(rays[k], triangle, everywhere),
            pipelined=seed % 2 == 1,
        )
        back = Walk(
            hierarchy=forest,
            beam=Beam(forest.nodes, rays[0].origin, [shadow_ray.origin - rays[0].origin for shadow_ray in shadow_rays]),
            meet=lambda triangle, k, shadow_rays=shadow_rays: FORMULA(shadow_rays[k], triangle, segment),
            pipelined=seed % 2 == 1,
        )
        met = nearest(walk, closer=CLOSER, limits=[types.Float(dr.inf)] * PER_LANE, width=LANES)
        blocked = any_hit(back, farthest=Single(WIDER), skips=None, active=[types.Bool(True)] * PER_LANE, width=LANES)

        for (t, _), expected in zip(met, tried(forest, rays, everywhere, LANES), strict=True):
            np.testing.assert_array_equal(np.array(t), expected, err_msg=f"scene {seed}")
            hits += np.isfinite(expected).sum()
        for t, expected in zip(blocked, tried(forest, shadow_rays, segment, LANES), strict=True):
            np.testing.assert_array_equal(np.isfinite(np.array(t)), np.isfinite(expected), err_msg=f"scene {seed}")
    assert hits > SCENES * LANES * PER_LANE * 0.2


def test_shadow_rays_that_part_lose_no_hit_either() -> None:
    types = array_types("float32")
    segment = Interval(nearest=types.Float(0), farthest=types.Float(1))
    light, hits = np.array([3.0, -2.0, 4.0], dtype=np.float32), 0
    for seed in range(40):
        generator = np.random.default_rng(seed)
        corners = (generator.uniform(-2, 2, (TRIANGLES, 1, 3)) + generator.normal(size=(TRIANGLES, 3, 3)) * 0.4).astype(
            np.float32
        )
        # Tiles of points close together, some of them on something that lies far behind; some have no point at all.
        points = generator.uniform(-2, 2, (LANES, 1, 3)) + 0.01 * generator.normal(size=(LANES, PER_LANE, 3))
        points[generator.random((LANES, PER_LANE)) < 0.2] -= [0.0, 1.5, 2.0]
        points[0, 0] = np.nan
        asked = generator.random((LANES, PER_LANE)) < 0.8
        forest = grown(corners, types)
        ends = [points[:, k].astype(np.float32) for k in range(PER_LANE)]
        shadow_rays = [Ray(origin=vector(types, end), direction=vector(types, light - end)) for end in ends]
        eye = types.Vector(*map(float, light))

        shadow_rays = prepared(shadow_rays)
        blocked = any_hit_in_groups(
            types,
            from_the_light(forest, shadow_rays, eye, segment),
            points=[shadow_ray.origin for shadow_ray in shadow_rays],
            alike=turns(shadow_rays),
            columns=2,
            eye=eye,
            sample=types.Float(0.01),
            skips=None,
            active=[types.Bool(np.ascontiguousarray(asked[:, k])) for k in range(PER_LANE)],
            width=LANES,
        )

        for k, expected in enumerate(tried(forest, shadow_rays, segment, LANES)):
            where = asked[:, k] & np.isfinite(points[:, k]).all(axis=1)
            found = np.isfinite(np.array(blocked[k]))
            np.testing.assert_array_equal(found[where], np.isfinite(expected)[where], err_msg=f"scene {seed}")
            hits += np.isfinite(expected)[where].sum()
    assert hits > 40 * LANES * PER_LANE * 0.05


@pytest.mark.parametrize("pipelined", [False, True])
@pytest.mark.parametrize("moved", [0.0, 1e3])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_no_ray_at_an_edge_or_a_corner_is_lost(moved: float, scale: float, pipelined: bool) -> None:
    types = array_types("float32")
    generator = np.random.default_rng(11)
    side, count = 24, 4096
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0), indexing="ij")
    sheet = np.stack([x, y, np.zeros_like(x)], axis=-1) + generator.uniform(-0.3, 0.3, (side + 1, side + 1, 3))
    sheet = ((sheet + moved) * scale).astype(np.float32)
    a, b, c, d = sheet[:-1, :-1], sheet[1:, :-1], sheet[1:, 1:], sheet[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    # Inner edges from their start (a corner) to their end; every other ray is aimed at the corner itself.
    i, j = generator.integers(2, side - 2, (2, count))
    along = np.where(np.arange(count) % 2, generator.uniform(0, 1, count), 0.0)[:, np.newaxis]
    target = sheet[i, j].astype(np.float64) * (1 - along) + sheet[i + 1, j + (np.arange(count) % 4 == 1)] * along
    origin = ((np.array([12.0, 9.0, 30.0]) + moved) * scale).astype(np.float32)
    directions = (target - origin).astype(np.float32).reshape(-1, PER_LANE, 3)
    forest = grown(corners, types)
    eye = types.Vector(*map(float, origin))
    rays = [Ray(origin=eye, direction=vector(types, directions[:, k])) for k in range(PER_LANE)]
    everywhere = Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))
    walk = Walk(
        hierarchy=forest,
        beam=Beam(forest.nodes, eye, [ray.direction for ray in rays]),
        meet=lambda triangle, k: FORMULA(rays[k], triangle, everywhere),
        pipelined=pipelined,
    )

    met = nearest(walk, closer=CLOSER, limits=[types.Float(dr.inf)] * PER_LANE, width=len(directions))

    for (t, _), expected in zip(met, tried(forest, rays, everywhere, len(directions)), strict=True):
        np.testing.assert_array_equal(np.array(t), expected)
        assert np.isfinite(expected).all()
