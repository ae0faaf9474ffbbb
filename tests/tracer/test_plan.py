"""Every way of tracing a scene gives the same picture, and the scene decides which one is taken."""

import dataclasses

import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import bumpy, soup, terrain
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Cube, Mesh, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.plan import Plan, plan
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, affine, camera, everything, matrix, octahedron, scene

UNROLLED = Plan()
KINDS = frozenset(("sphere", "cube", "square", "triangle"))


def crowd() -> Scene:
    """Return nine of each kind of shape, sheared squares among them, and a mesh, on a floor."""
    generator = np.random.default_rng(4)
    placed = []
    for k, (x, y, z) in enumerate(generator.uniform((-2, -2, 0.3), (2, 2, 2), (36, 3)).tolist()):
        linear = np.array(affine(100 + k, (0.0, 0.0, 0.0)))[:3, :3]
        placed.append(matrix(linear * 0.4, (x, y, z)))
    corners = ((-1.0, -0.7, 0.1), (1.1, -0.5, 0.0), (0.1, 0.9, 0.4))
    shapes = (
        *(Sphere(albedo=(0.1 * k, 0.5, 0.6), center=(0.2, 0.1, 0.0), to_world=placed[k]) for k in range(1, 9)),
        *(Cube(albedo=(0.5, 0.1 * k, 0.6), to_world=placed[9 + k]) for k in range(1, 9)),
        *(Square(albedo=ALBEDO, two_sided=k % 2 == 0, to_world=placed[18 + k]) for k in range(1, 9)),
        *(Triangle(albedo=ALBEDO, vertices=corners, to_world=placed[27 + k]) for k in range(1, 9)),
        octahedron(to_world=placed[0]),
        FLOOR,
    )
    return scene(*shapes, lights=(LIGHT,))


def agree(what: Scene, one: Plan, other: Plan, precision: str) -> None:
    """Assert that two plans give the same stages, up to the few roundings in which their arithmetic differs."""
    first, second = (render(what, IMAGE_STAGES, Configuration(precision=precision), chosen=p) for p in (one, other))
    limit = 1e-4 if precision == "float32" else 1e-12
    same = (first[Stage.OBJECT] == second[Stage.OBJECT]).all(axis=-1)
    assert same.mean() >= 0.998  # edges, on which a rounding decides
    lit = (first[Stage.VISIBILITY] == second[Stage.VISIBILITY]).all(axis=-1)
    assert lit[same].mean() >= 0.998
    for stage in set(IMAGE_STAGES) - {Stage.OBJECT, Stage.VISIBILITY}:
        ours, theirs = (np.where(np.isfinite(a[stage]), a[stage], -1)[same & lit] for a in (first, second))
        np.testing.assert_allclose(ours, theirs, rtol=limit, atol=limit)


@pytest.mark.parametrize("tables", [False, True])
@pytest.mark.parametrize("split", [False, True])
def test_trees_and_tables_give_what_unrolling_gives(split: bool, tables: bool, precision: str) -> None:
    trees = Plan(columns=2, rows=2, split=split, trees=KINDS, tables=tables)

    agree(crowd(), UNROLLED, trees, precision)


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (4, 4), (4, 1), (8, 1)])
def test_any_tile_gives_the_same_image(columns: int, rows: int) -> None:
    # 41 x 30 is no multiple of a tile or of a block of tiles.
    what = everything(camera=camera(width=41))
    usual = plan(what, Configuration())

    agree(what, usual, dataclasses.replace(usual, columns=columns, rows=rows, split=False), "float32")


@pytest.mark.parametrize("width", [40, 41])
@pytest.mark.parametrize("columns", [1, 4, 8])
def test_frames_are_the_radiance_again_and_again(columns: int, width: int) -> None:
    what = everything(camera=camera(width=width))
    chosen = dataclasses.replace(plan(what, Configuration()), columns=columns, rows=1, split=columns == 1)
    frames = Frames(what, Configuration(), chosen=chosen)

    first, second = frames.pixels(), frames.pixels()

    np.testing.assert_array_equal(first, second)
    expected = render(what, (Stage.RADIANCE,), Configuration(), chosen=chosen)[Stage.RADIANCE]
    np.testing.assert_allclose(first, expected, rtol=1e-6, atol=1e-7)
    assert (first > 0).mean() > 0.5


def centers(mesh: Mesh) -> np.ndarray:
    """Return, for each vertex of a mesh whose faces share none, the middle of its face."""
    return mesh.vertices.reshape(-1, 3, 3).mean(axis=1).repeat(3, axis=0)


def test_the_scene_decides() -> None:
    def large(what: Scene) -> Scene:
        return dataclasses.replace(what, camera=camera(width=512, height=512))

    sphere = Sphere(albedo=ALBEDO)
    default = Configuration()
    endless = Configuration(formulas={"segment": "endless"})

    assert plan(scene(sphere, FLOOR), default) == UNROLLED
    assert plan(large(scene(sphere, FLOOR)), default) == Plan(columns=8)
    assert plan(large(scene(sphere, FLOOR)), Configuration(precision="float64")) == Plan(columns=4)
    assert plan(large(scene(*[sphere] * 5)), default) == Plan(columns=4)
    assert plan(large(scene(*[sphere] * 20)), default) == Plan(columns=4, tables=True)
    assert plan(large(scene(*[sphere] * 30)), default).trees == {"sphere"}
    assert plan(scene(*[sphere] * 20), default).trees == {"sphere"}
    assert plan(scene(*[sphere] * 20), default).tables
    assert plan(scene(octahedron()), default).split
    assert not plan(large(scene(octahedron())), default).split
    # Triangles larger than pixels, about as small, and smaller ones.
    double = Configuration(precision="float64")
    for cells, configuration, tile in (
        (200, default, (4, 4)),
        (300, default, (4, 2)),
        (600, default, (4, 2)),
        (600, double, (2, 2)),
        (1000, default, (2, 2)),
    ):
        hills = terrain(cells)
        chosen = plan(large(scene(hills)), configuration)
        assert (chosen.columns, chosen.rows, chosen.split) == (*tile, False)
        assert chosen.pipelined is (tile != (4, 4))
        # A small image goes by nested loops.
        assert not plan(scene(hills), configuration).pipelined
    # Of as many triangles, a closed body goes two by two.
    view = camera(width=384, height=384)
    assert [plan(scene(mesh, camera=view), default).columns for mesh in (terrain(400), bumpy(7))] == [4, 2]
    # About as many faces as samples, far apart, and one behind the other: there shadow rays go by themselves.
    dust = soup(200_000)
    thick = dataclasses.replace(dust, vertices=dust.vertices + 5 * (dust.vertices - centers(dust)))
    assert [plan(large(scene(mesh)), default).split for mesh in (dust, thick)] == [False, True]
    # One loop goes through them; in float64, of small triangles only.
    assert plan(large(scene(thick)), default).pipelined
    assert not plan(large(scene(thick)), double).pipelined
    # A shadow ray that goes on behind the light cannot be bounded from there.
    assert plan(large(scene(octahedron())), endless).split


@pytest.mark.parametrize("what", [scene(Sphere(albedo=ALBEDO), FLOOR), everything()], ids=["unrolled", "trees"])
@pytest.mark.parametrize("shadow_ray", ["normal_offset", "doubles"])
def test_many_lights_are_the_sum_of_few(what: Scene, shadow_ray: str, precision: str) -> None:
    generator = np.random.default_rng(6)
    places = generator.uniform((-4, -4, 3), (4, 4, 6), (9, 3)).tolist()
    lights = tuple(PointLight(position=(x, y, z), flux=(30.0 + k, 20.0, 10.0)) for k, (x, y, z) in enumerate(places))
    configuration = Configuration(precision=precision, formulas={"shadow_ray": shadow_ray})
    stages = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE)

    together = render(dataclasses.replace(what, lights=lights), stages, configuration)
    parts = [render(dataclasses.replace(what, lights=lights[k : k + 3]), stages, configuration) for k in (0, 3, 6)]

    visible = np.concatenate([part[Stage.VISIBILITY] for part in parts], axis=-1)
    np.testing.assert_array_equal(together[Stage.VISIBILITY], visible)
    for stage in (Stage.IRRADIANCE, Stage.RADIANCE):
        total = sum(part[stage] for part in parts)
        np.testing.assert_allclose(together[stage], total, rtol=16 * UNIT_ROUNDOFF[precision])
