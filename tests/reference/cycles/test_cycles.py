"""Cycles' pictures against closed forms, what it refuses, and what it leaves behind: nothing."""

import tempfile
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.cycles import ANSWERED, program
from tests.reference.pictured import (
    ALBEDO,
    FIRST,
    SECOND,
    answer,
    floor_irradiance,
    floor_points,
    looking_down,
    placed,
    raised,
    tetrahedron,
)

CLOSE = 40 * 2.0**-24
FLOOR = Square(albedo=ALBEDO, to_world=raised(0, 20.0))
HIT = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
LIT = Scene(camera=looking_down(height=5), shapes=(FLOOR,), lights=(FIRST, SECOND))


@pytest.fixture
def cycles():
    reference: Any = REFERENCES["cycles"]
    if missing := reference.missing():
        pytest.skip(missing)
    return reference()


def test_without_blender_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setenv(program.VARIABLE, "/nonexistent/python")
    reference: Any = REFERENCES["cycles"]

    assert "pip install bpy" in reference.missing()
    assert reference().unsupported(LIT, Stage.OBJECT) == reference.missing()
    assert REFERENCES.about("cycles") == {"independent": True, "optional": True}
    with pytest.raises(RuntimeError, match="not installed"):
        reference().render(LIT, [Stage.OBJECT])


@pytest.mark.process
def test_a_failure_is_reported_with_what_blender_said(tmp_path, monkeypatch):
    fake = tmp_path / "python"
    fake.write_text("#!/bin/sh\necho no cube today\nexit 3\n")
    fake.chmod(0o755)
    monkeypatch.setenv(program.VARIABLE, str(fake))

    with pytest.raises(RuntimeError, match="ended with 3: no cube today"):
        REFERENCES["cycles"]().render(LIT, [Stage.OBJECT])


def test_a_floor_is_lit_by_both_lights_and_nothing_is_left_behind(cycles, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    position, radiance = answer(cycles, LIT, Stage.POSITION, Stage.RADIANCE)

    points = floor_points(LIT.camera)
    expected = sum(floor_irradiance(points, light) for light in LIT.lights) * np.asarray(ALBEDO) / np.pi
    assert np.abs(position - points).max() <= CLOSE * 5
    assert np.abs(radiance / expected - 1).max() <= CLOSE
    assert list(tmp_path.iterdir()) == []


def test_no_seam_of_a_square_is_dark(cycles):
    """Along a diagonal, which symmetrical scenes have pixels on, Cycles darkens what two triangles share."""
    (case,) = select(["flux_conservation/floor"])
    (light,) = case.scene.lights

    position, radiance = answer(cycles, case.scene, Stage.POSITION, Stage.RADIANCE)

    diagonal = np.abs(np.abs(position[..., 0]) - np.abs(position[..., 1])) <= CLOSE
    assert diagonal.sum() > 100
    assert np.array_equal(radiance[diagonal] > 0, np.broadcast_to(np.array(light.flux) > 0, radiance[diagonal].shape))


def test_small_faces_keep_the_digits_of_their_normals(cycles):
    (case,) = select(["meshes/torus"])
    objects, normal = answer(cycles, case.scene, Stage.OBJECT, Stage.NORMAL)
    theirs, closed = answer(REFERENCES["analytic"](), case.scene, Stage.OBJECT, Stage.NORMAL)
    torus = next(shape for shape in case.scene.shapes if isinstance(shape, Mesh))
    corners = world_triangles(torus).astype(np.float64)
    sides = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(sides, axis=-1).max(axis=1)
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=-1)

    same = (objects == theirs).all(axis=-1) & (objects[..., 0] == case.scene.shapes.index(torus))
    assert same.sum() > 100
    # Two differences, a product, a sum, and three for unit length; magnified where two sides are nearly parallel.
    limit = gamma(7, precision="float32") * (lengths**2 / areas)[objects[same][:, 1].astype(int)]
    assert (np.abs(normal - closed)[same].max(axis=-1) <= limit).all()


def test_shapes_are_hit_where_they_are_and_one_sided_ones_are_black_from_behind(cycles):
    turned = placed(((1, 0, 0), (0, -1, 0), (0, 0, -1)), -1.2, 0, 1)
    mirrored = placed(((-0.8, 0, 0), (0, 0.8, 0), (0, 0, 0.8)), 1.2, 0, 1)
    ball = placed(((0, -0.5, 0), (0.5, 0, 0), (0, 0, 0.5)), 0, 1, 1)
    shapes = (
        Square(albedo=ALBEDO, to_world=turned),
        tetrahedron(to_world=mirrored),
        Sphere(albedo=ALBEDO, to_world=ball),
        Cube(albedo=ALBEDO, to_world=placed(np.eye(3) * -0.6, 0, -0.6, 1)),
        replace(FLOOR, two_sided=True),
    )
    light = PointLight(position=(0.2, 0.1, 6.0), flux=(100.0, 70.0, 30.0))
    scene = Scene(camera=looking_down(height=7), shapes=shapes, lights=(light,))

    objects, distance, position, normal, radiance = answer(cycles, scene, *HIT, Stage.RADIANCE)

    assert [(objects[..., 0] == index).any() for index in range(5)] == [True] * 5
    square, mesh, sphere, cube, floor = (objects[..., 0] == index for index in range(5))
    assert np.abs(normal[square] - (0, 0, -1)).max() <= CLOSE
    assert not radiance[square].any()
    # The upper edge of the tetrahedron parts these two.
    assert set(objects[mesh][:, 1]) == {1, 2}
    assert (normal[mesh][:, 2] > 0).all()
    assert np.abs(normal[sphere] - (position[sphere] - (0, 1, 1)) / 0.5).max() <= CLOSE * 10
    assert np.abs(position[cube][:, 2] - 1.3).max() <= CLOSE
    assert np.abs(normal[cube] - (0, 0, 1)).max() <= CLOSE
    assert radiance[cube].all()
    assert np.abs(distance[floor][:, 0] - np.linalg.norm(position[floor] - (0, 0, 7), axis=1)).max() <= CLOSE


def test_clipping_is_by_depth_and_samples_are_the_centres_of_a_subdivision(cycles):
    lid = replace(FLOOR, to_world=raised(4.0, 20.0))
    scene = replace(LIT, camera=looking_down(height=5, near=2), shapes=(FLOOR, lid), lights=())
    under = replace(scene, lights=(replace(FIRST, position=(0.3, -0.2, 2.5)),))

    (objects,) = answer(cycles, scene, Stage.OBJECT)
    (radiance,) = answer(cycles, under, Stage.RADIANCE, samples=2)

    fine = floor_irradiance(floor_points(LIT.camera, 2), FIRST) * np.asarray(ALBEDO) / np.pi
    assert not objects.any()
    assert np.abs(radiance / fine.reshape(19, 2, 25, 2, 3).mean(axis=(1, 3)) - 1).max() <= CLOSE


def test_it_refuses_what_it_would_draw_otherwise(cycles):
    squeezed = placed(((1, 0, 0), (0, 1, 0), (0, 0, 0.9)), 0, 0, 0)

    def why(stage=Stage.RADIANCE, **changes):
        return cycles.unsupported(replace(LIT, **changes), stage)

    assert [stage for stage in IMAGE_STAGES if why(stage) is None] == list(ANSWERED)
    assert "infinite plane" in why(shapes=(Plane(albedo=ALBEDO),))
    assert "ellipsoid" in why(shapes=(Sphere(albedo=ALBEDO, to_world=squeezed),))
    assert "inside" in why(shapes=(Sphere(albedo=ALBEDO, radius=5.5),))
    assert "inside" in why(shapes=(Sphere(albedo=ALBEDO, radius=4.95),))
    assert "planes" in why(clip="shell")
    assert "inverse square" in why(shading="simplified")
    assert why(Stage.OBJECT, shading="simplified") is None
    assert "albedo" in why(shapes=(replace(FLOOR, albedo=(0.1, 1.2, 0.3)),))
    assert "degrees" in why(camera=looking_down(height=5, fovy=0.1))


def test_version_and_settings_say_what_was_run(cycles):
    assert cycles.version().startswith("Cycles of Blender ")
    assert cycles.settings(LIT)["samples"] == "1"
