"""What is drawn of a scene is bounded: of many lights some, of a large mesh what a picture can show."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import PointLight
from rayproof.reports.publish.scene3d.parts import ball, look, thinned, view_of


def test_of_a_thousand_lights_some_are_drawn_the_first_and_the_last_among_them() -> None:
    scene = select(["shadows/*"])[0].scene
    lights = tuple(PointLight(position=(n / 1000, 0.0, 9.0), flux=(1.0, 1.0, 1.0)) for n in range(1000))

    view = view_of(replace(scene, lights=lights), None, None, None)

    (part,) = (part for part in view.parts if part.layer == "lights")
    places = part.points.reshape(-1, len(ball(12).points), 3).mean(axis=1) * view.size + view.middle
    assert len(places) == look().lights
    assert places[[0, -1], 0] == pytest.approx([0.0, 0.999], abs=1e-9)


def sheet(side: int) -> np.ndarray:
    """Return a square of side x side cells, two triangles each, as (faces, 3, 3)."""
    across, down = np.meshgrid(np.arange(side), np.arange(side))
    corner = np.stack([across, down, 0 * down], axis=-1).reshape(-1, 1, 3).astype(np.float32)
    steps = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=np.float32)
    return (corner[:, np.newaxis] + steps).reshape(-1, 3, 3)


def test_a_large_mesh_is_thinned_and_keeps_its_place_and_its_area() -> None:
    corners = sheet(300)

    few = thinned(corners, 20_000)

    assert len(few) < 20_000 < len(corners)
    assert np.isin(few.reshape(-1, 3)[:, 0], corners[..., 0]).all()
    area = np.linalg.norm(np.cross(few[:, 1] - few[:, 0], few[:, 2] - few[:, 0]), axis=-1).sum() / 2
    assert abs(area / 300**2 - 1) < 0.05


def test_of_specks_that_lie_apart_some_are_left() -> None:
    specks = sheet(1)[:1] * 1e-4 + np.arange(50_000, dtype=np.float32)[:, np.newaxis, np.newaxis]

    assert 1000 <= len(thinned(specks, 5_000)) <= 5_000
    assert thinned(specks[:10], 5_000) is not None
