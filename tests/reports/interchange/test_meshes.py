"""Bare meshes in: all of the mesh in view and lit, whatever its size and place."""

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import trimesh

from rayproof.cases.scene import Camera, Cube, Mesh, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import ImportOptions, import_scene
from rayproof.reports.interchange.framing import bounds, camera_for, is_dark, light_for, matrix


@pytest.mark.process
@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
@pytest.mark.parametrize(("scale", "place"), [(1.0, (0, 0, 0)), (1e-3, (5, -2, 1)), (1e4, (0, 3e4, 0))])
def test_the_whole_mesh_is_in_view_and_lit(suffix: str, scale: float, place, tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=scale)
    mesh.apply_translation(place)
    file = tmp_path / f"ball.{suffix}"
    mesh.export(str(file))

    imported = import_scene(file, ImportOptions(size=(48, 40)))
    answers = Analytic().render(imported.scene, [Stage.OBJECT, Stage.RADIANCE])

    hit = answers[Stage.OBJECT][..., 0] == 0
    # The sphere around the bounding box fills the height; the ball itself is smaller by the root of three.
    assert 0.1 < hit.mean() < 0.5
    assert not hit[[0, -1]].any()
    assert not hit[:, [0, -1]].any()
    assert (answers[Stage.RADIANCE][hit].max(axis=1) > 0).mean() > 0.5
    assert len(imported.dropped) == 2


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("distance", [0.02, 800.0])
def test_the_light_follows_from_what_is_in_view(up: Literal["y", "z"], distance: float) -> None:
    # The camera's own target is 1 m ahead, as in files that name a direction: it says nothing of the scene's size.
    made = camera_for((Sphere(albedo=(0.5, 0.5, 0.5), radius=0.3 * distance),), (33, 25), up=up)
    eye = np.array(made.eye)
    ahead = eye - eye / np.linalg.norm(eye)
    camera = replace(made, target=(float(ahead[0]), float(ahead[1]), float(ahead[2])))
    ball = Sphere(albedo=(0.5, 0.5, 0.5), radius=0.3 * distance)

    light, dark = light_for(camera, (ball,))
    scene = Scene(camera=camera, shapes=(ball,), lights=(light,))
    irradiance = Analytic().render(scene, [Stage.IRRADIANCE])[Stage.IRRADIANCE]

    assert dark is None
    assert irradiance[12, 16] == pytest.approx([1, 1, 1])
    right = np.cross(ahead - eye, camera.up)
    assert (light.position - eye) @ right > 0
    assert (light.position - eye) @ np.array(camera.up) > 0


def test_in_a_room_the_light_stays_inside() -> None:
    walls = tuple(
        Cube(
            albedo=(0.5, 0.5, 0.5),
            to_world=matrix(np.diag([*size, 1.0]) + np.pad(np.reshape(place, (3, 1)), ((0, 1), (3, 0)))),
        )
        for size, place in (
            ((0.1, 1.1, 1.1), (-0.55, 0, 0)),
            ((0.1, 1.1, 1.1), (0.55, 0, 0)),
            ((1.1, 0.1, 1.1), (0, -0.55, 0)),
            ((1.1, 0.1, 1.1), (0, 0.55, 0)),
            ((1.1, 1.1, 0.1), (0, 0, -0.55)),
            ((1.1, 1.1, 0.1), (0, 0, 0.55)),
        )
    )
    camera = Camera(
        eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0),
        fovy=60.0, width=33, height=25, near=0.01, far=100.0,
    )  # fmt: skip

    light, dark = light_for(camera, walls)

    assert dark is None
    assert np.abs(light.position).max() < 0.5


def test_what_is_seen_from_its_unlit_side_alone_is_reported() -> None:
    away = Square(albedo=(0.5, 0.5, 0.5), to_world=matrix(np.diag([1.0, 1.0, -1.0, 1.0])))
    camera = Camera(
        eye=(0.0, 0.0, 3.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0),
        fovy=40.0, width=8, height=8, near=0.1, far=10.0,
    )  # fmt: skip

    light, dark = light_for(camera, (away,))

    assert dark is not None
    assert "from its unlit side" in dark
    assert is_dark(Scene(camera=camera, shapes=(away,), lights=(light,)))


def test_all_shapes_are_between_the_planes_and_these_are_near_each_other() -> None:
    shapes = tuple(Sphere(albedo=(0.5, 0.5, 0.5), center=(x, 0.0, 0.0), radius=0.5) for x in (-3.0, 0.0, 5.0))
    camera = camera_for(shapes, up="z")

    low, high = bounds(shapes)
    forward = np.subtract(camera.target, camera.eye)
    forward /= np.linalg.norm(forward)
    depths = [forward @ np.subtract(shape.center, camera.eye) for shape in shapes]
    assert (low.tolist(), high.tolist()) == ([-3.5, -0.5, -0.5], [5.5, 0.5, 0.5])
    assert camera.near < min(depths) - 0.5
    assert max(depths) + 0.5 < camera.far < 10 * camera.near


@pytest.mark.process
def test_numbers_keep_their_digits(tmp_path: Path) -> None:
    (tmp_path / "one.obj").write_text("v 0.1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    (mesh,) = import_scene(tmp_path / "one.obj").scene.shapes

    assert isinstance(mesh, Mesh)
    assert mesh.vertices[0, 0] == np.float32(0.1)


@pytest.mark.process
@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
def test_the_axis_that_points_up_is_chosen_and_the_default_named(suffix: str, tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(str(tmp_path / f"box.{suffix}"))

    default, chosen = (import_scene(tmp_path / f"box.{suffix}", ImportOptions(up=up)) for up in (None, "y"))

    assert default.scene.camera.up == (0, 0, 1)
    assert chosen.scene.camera.up == (0, 1, 0)
    assert chosen.scene.camera.eye[2] > 0
    assert "with z upward (--up y turns it)" in default.dropped[-1]
    assert chosen.dropped[-1].endswith("with y upward")
