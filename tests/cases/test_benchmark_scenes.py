"""The benchmark's scenes are what their names say, and the same every time."""

import numpy as np
import pytest

from rayproof.cases import benchmark_scenes
from rayproof.cases.benchmark_scenes import SCENES, bumpy, chosen, city, mountains, rods, scanned, soup, terrain, uneven
from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic


@pytest.mark.parametrize("subdivisions", [0, 3, 5])
def test_bumpy_balls_have_the_triangles_they_claim(subdivisions: int) -> None:
    assert len(bumpy(subdivisions).faces) == 20 * 4**subdivisions


def test_uneven_is_uneven() -> None:
    mesh = uneven(20_000)
    corners = mesh.vertices[mesh.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)

    assert 10_000 < len(mesh.faces) < 30_000
    assert np.quantile(edges.max(axis=1), 0.9) / np.quantile(edges.min(axis=1), 0.1) > 100
    assert (area > 0).all()


def test_a_scan_has_holes_noise_and_no_order() -> None:
    mesh = scanned(4)

    assert 0.7 * 20 * 4**4 < len(mesh.faces) < 0.98 * 20 * 4**4
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    steps = np.linalg.norm(np.diff(centers, axis=0), axis=1)
    assert np.median(steps) > 0.5  # neighbours in the file are no neighbours in space
    assert mesh is scanned(4)


def test_rods_are_thin_and_a_city_stands_on_its_ground() -> None:
    thin = rods(200)
    corners = thin.vertices[thin.faces].astype(np.float64)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    houses = city(6)

    assert (edges.max(axis=1) > 10 * edges.min(axis=1)).all()
    assert (len(thin.faces), len(houses.faces), len(terrain(10).faces), len(soup(50).faces)) == (200, 362, 200, 50)
    assert houses.vertices[:, 2].min() == 0
    # Houses are seen from outside: each wall's winding shows away from its house's middle.
    walls = houses.vertices[houses.faces[:-2]].astype(np.float64)
    normals = np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
    middles = walls.reshape(36, 30, 3).mean(axis=1).repeat(10, axis=0)
    assert (np.sum(normals * (walls.mean(axis=1) - middles), axis=1) > 0).all()


def test_measured_mountains_stand_as_high_and_as_far_apart_as_they_are_with_their_front_up() -> None:
    mesh = mountains()
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    size = np.ptp(mesh.vertices, axis=0)

    assert len(mesh.faces) == 2 * 343 * 402
    assert (up > 0).all()
    # 236 m to 1076 m above the sea, 344 rows of 3 seconds of arc from north to south.
    assert size[2] / size[1] == pytest.approx((1076 - 236) / (343 * 3 / 3600 / 360 * 40_030_000), rel=1e-2)
    assert 0.9 < size[0] / size[1] < 1


def test_where_nobody_installed_what_was_measured_the_scene_says_why_it_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (bench,) = chosen(("mountains",), quick=False)
    assert bench.missing() is None

    monkeypatch.setattr(benchmark_scenes, "find_spec", lambda name: None)

    assert "no sample_data/jacksboro_fault_dem.npz" in str(bench.missing())
    with pytest.raises(FileNotFoundError, match="jacksboro"):
        mountains.__wrapped__()


@pytest.mark.parametrize("name", [scene.name for scene in SCENES if scene.quick])
def test_every_quick_scene_shows_something_lit(name: str) -> None:
    (bench,) = chosen((name,), quick=False)
    scene = bench.scene(24, 24)

    answers = Analytic().render(scene, [Stage.OBJECT, Stage.RADIANCE])

    assert (answers[Stage.OBJECT][..., 0] >= 0).mean() > 0.2
    assert (answers[Stage.RADIANCE].max(axis=-1) > 0).mean() > 0.1
    assert len(scene.lights) == bench.lights


def test_quick_leaves_the_large_ones_out() -> None:
    assert {scene.name for scene in chosen((), quick=False)} > {scene.name for scene in chosen((), quick=True)}
    assert not any("330k" in scene.name for scene in chosen((), quick=True))


def test_meshes_are_baked_already() -> None:
    for bench in SCENES[:6]:
        for shape in bench.scene(8, 8).shapes:
            if isinstance(shape, Mesh):
                assert np.array_equal(shape.to_world, np.eye(4))
