"""Bare meshes in: all of the mesh in view and lit, whatever its size and place."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from rayproof.cases.scene import Mesh, SceneError, Sphere
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import IMPORTERS, import_scene
from rayproof.reports.interchange.framing import bounds, camera_for, light_for


@pytest.mark.process
@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
@pytest.mark.parametrize(("scale", "place"), [(1.0, (0, 0, 0)), (1e-3, (5, -2, 1)), (1e4, (0, 3e4, 0))])
def test_the_whole_mesh_is_in_view_and_lit(suffix: str, scale: float, place, tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=scale)
    mesh.apply_translation(place)
    file = tmp_path / f"ball.{suffix}"
    mesh.export(str(file))

    imported = import_scene(file, (48, 40))
    answers = Analytic().render(imported.scene, [Stage.OBJECT, Stage.RADIANCE])

    hit = answers[Stage.OBJECT][..., 0] == 0
    # The sphere around the bounding box fills the height; the ball itself is smaller by the root of three.
    assert 0.1 < hit.mean() < 0.5
    assert not hit[[0, -1]].any()
    assert not hit[:, [0, -1]].any()
    assert (answers[Stage.RADIANCE][hit].max(axis=1) > 0).mean() > 0.5
    assert len(imported.dropped) == 2


def test_the_light_is_above_the_right_shoulder_and_gives_a_watt_per_square_metre_at_the_target() -> None:
    ball = Sphere(albedo=(0.5, 0.5, 0.5), center=(3.0, 1.0, -2.0), radius=0.1)
    camera = camera_for((ball,))
    light = light_for(camera)

    eye, target = np.array(camera.eye), np.array(camera.target)
    away = np.array(light.position) - target
    assert np.array(light.flux) / (4 * np.pi * away @ away) == pytest.approx(1)
    assert (light.position - eye) @ np.cross(target - eye, camera.up) > 0
    assert (light.position - eye) @ np.array(camera.up) > 0


def test_all_shapes_are_between_the_planes_and_these_are_near_each_other() -> None:
    shapes = tuple(Sphere(albedo=(0.5, 0.5, 0.5), center=(x, 0.0, 0.0), radius=0.5) for x in (-3.0, 0.0, 5.0))
    camera = camera_for(shapes)

    low, high = bounds(shapes)
    forward = np.subtract(camera.target, camera.eye)
    forward /= np.linalg.norm(forward)
    depths = [forward @ np.subtract(shape.center, camera.eye) for shape in shapes]
    assert (low.tolist(), high.tolist()) == ([-3.5, -0.5, -0.5], [5.5, 0.5, 0.5])
    assert camera.near < min(depths) - 0.5
    assert max(depths) + 0.5 < camera.far < 10 * camera.near


@pytest.mark.parametrize("name", ["nothing.obj", "nothing.xyz"])
def test_what_cannot_be_read_is_told(name: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=name.replace(".", r"\.")):
        import_scene(tmp_path / name)


@pytest.mark.process
def test_every_importer_refuses_an_empty_file(tmp_path: Path) -> None:
    for suffix in IMPORTERS:
        (tmp_path / f"empty{suffix}").touch()
        with pytest.raises(SceneError, match="empty"):
            import_scene(tmp_path / f"empty{suffix}")


@pytest.mark.process
def test_numbers_keep_their_digits(tmp_path: Path) -> None:
    (tmp_path / "one.obj").write_text("v 0.1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    (mesh,) = import_scene(tmp_path / "one.obj").scene.shapes

    assert isinstance(mesh, Mesh)
    assert mesh.vertices[0, 0] == np.float32(0.1)


@pytest.mark.process
def test_what_a_mesh_file_holds_beside_triangles_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nvn 0 0 1\nvt 0 0\nl 1 2\nf 1 2 3\n"
    )
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n"
    )

    text, points = ("\n".join(import_scene(tmp_path / name).dropped) for name in ("a.obj", "a.ply"))

    for sentence in ("vertex normals (1", "texture coordinates", "material libraries", "lines (1", "vertex colours"):
        assert sentence in text
    assert "the property 'red' of each vertex" in points
