"""The benchmark's scenes are what their names say, and the same every time."""

import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import SCENES, chosen, mountains
from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic


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


@pytest.mark.parametrize("name", [scene.name for scene in SCENES if scene.quick])
def test_every_quick_scene_shows_something_lit(name: str) -> None:
    (bench,) = chosen((name,), quick=False)
    scene = bench.scene(24, 24)

    answers = Analytic().render(scene, [Stage.OBJECT, Stage.RADIANCE])

    assert (answers[Stage.OBJECT][..., 0] >= 0).mean() > 0.2
    assert (answers[Stage.RADIANCE].max(axis=-1) > 0).mean() > 0.1
    assert len(scene.lights) == bench.lights


def test_meshes_are_baked_already() -> None:
    for bench in SCENES[:6]:
        for shape in bench.scene(8, 8).shapes:
            if isinstance(shape, Mesh):
                assert np.array_equal(shape.to_world, np.eye(4))
