"""The text that is written for POV-Ray; POV-Ray 3.7 drew 59 cases of the suite from it as the closed forms do."""

import re
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle
from rayproof.reports.interchange import export_scene
from rayproof.reports.interchange.povray_writing import FADE, LIT_SCALE, TRIANGLES

GREY = (0.5, 0.25, 0.125)
CAMERA = Camera(eye=(0, 0, 5), target=(0, 0, 0), up=(0, 1, 0), fovy=40, width=8, height=4, near=0.5, far=20)
SHEARED = ((1, 0.5, 0, 3), (0, 2, 0, 4), (0, 0, 1, 5), (0, 0, 0, 1))


def written(folder: Path, *shapes: Shape, **about: object) -> tuple[str, tuple[str, ...]]:
    """Return what is written for some shapes, and what POV-Ray does differently."""
    scene = Scene(camera=CAMERA, shapes=shapes or (Sphere(albedo=GREY),), **about)
    differences = export_scene(scene, folder / "scene.pov")
    return (folder / "scene.pov").read_text(encoding="ascii"), differences


def vectors(text: str) -> list[list[float]]:
    """Return the vectors of a text, in order."""
    return [[float(number) for number in match.split(",")] for match in re.findall(r"<([^>]+)>", text)]


def test_the_camera_spans_the_vertical_angle_and_the_aspect_by_explicit_vectors(tmp_path: Path) -> None:
    text, _ = written(tmp_path)

    assert "#declare Eye = <0,0,5>;" in text
    assert "#declare Rightward = vnormalize(vcross(Forward, vnormalize(<0,1,0>)));" in text
    assert "#declare Across = Rightward * (tan(radians(40) / 2) * 8 / 4);" in text
    assert "camera { perspective location Eye direction Forward right 2 * Across up 2 * Along }" in text


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Sphere(albedo=GREY, center=(1, 2, 3), radius=0.5), "sphere { <1,2,3>, 0.5 "),
        (Cube(albedo=GREY), "box { -<0.5,0.5,0.5>, <0.5,0.5,0.5> "),
        (Square(albedo=GREY), "polygon { 4, <-0.5,-0.5,0>, <0.5,-0.5,0>, <0.5,0.5,0>, <-0.5,0.5,0> "),
        (Plane(albedo=GREY), "plane { <0,0,1>, 0 "),
    ],
    ids=["sphere", "cube", "square", "plane"],
)
def test_a_shape_has_its_matrix_column_by_column_and_the_translation_last(
    shape: Shape, expected: str, tmp_path: Path
) -> None:
    text, _ = written(tmp_path, replace(shape, to_world=SHEARED))

    (line,) = (line for line in text.splitlines() if line.startswith("#declare Solid0 = "))
    assert line.startswith(f"#declare Solid0 = {expected}")
    assert line.endswith("matrix <1,0,0,0.5,2,0,0,0,1,3,4,5> }")


def test_triangles_are_wound_for_povray_and_have_every_digit(tmp_path: Path) -> None:
    corners = ((0.1, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    text, _ = written(tmp_path, Triangle(albedo=GREY, vertices=corners))

    first, second, third = (np.array(vector) for vector in vectors(text[text.index("triangle") :])[:3])
    assert first[0] == float(np.float32(0.1)), "the corner that every renderer of a float32 mesh sees"
    outward = np.cross(first - second, third - second)
    assert outward @ (0, 0, 1) > 0


def test_a_mesh_is_nested_unions_with_bounds_and_without_flat_faces(tmp_path: Path) -> None:
    count = 4 * TRIANGLES
    angles = np.linspace(0, 2 * pi, count, endpoint=False)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=-1)
    faces = np.array([(count, number, (number + 1) % count) for number in range(count)] + [(0, 0, 1)])
    mesh = Mesh(albedo=GREY, vertices=np.vstack([rim, [(0, 0, 0)]]).astype(np.float32), faces=faces.astype(np.int32))

    text, _ = written(tmp_path, mesh)

    assert text.count("triangle {") == count
    assert text.count("union {") == text.count("bounded_by {") == 7
    for bound, below in re.findall(r"bounded_by \{ box \{ (<[^>]+>), (<[^>]+>)", text):
        assert np.all(np.subtract(vectors(below)[0], vectors(bound)[0]) > 0)


def test_a_light_carries_the_pi_that_povray_s_reflection_lacks_and_fades_by_the_square(tmp_path: Path) -> None:
    light = PointLight(position=(1, 2, 3), flux=(10, 20, 30))

    text, differences = written(tmp_path, lights=(light,))

    (line,) = (line for line in text.splitlines() if line.startswith("light_source"))
    place, color = vectors(line)
    assert place == [1024, 2048, 3072]
    distance = 2.0 * 2**LIT_SCALE  # units: two metres
    faded = np.array(color) * 2 / (1 + (distance / FADE) ** 2)
    assert faded == pytest.approx(np.array(light.flux) / (4 * pi * 2.0**2) / pi, rel=1e-12)
    assert f"fade_distance {FADE:.17g} fade_power 2" in line
    assert len(differences) == 1
    assert "9.8e-07 m" in differences[0]


def test_a_lit_scene_is_larger_by_a_power_of_two_object_space_included(tmp_path: Path) -> None:
    light = PointLight(position=(1, 2, 3), flux=(10, 20, 30))

    text, _ = written(tmp_path, Sphere(albedo=GREY, radius=0.5, to_world=SHEARED), lights=(light,))

    assert "sphere { <0,0,0>, 512 " in text
    assert "matrix <1,0,0,0.5,2,0,0,0,1,3072,4096,5120> }" in text


@pytest.mark.parametrize("two_sided", [True, False])
def test_only_a_one_sided_surface_is_black_from_behind(two_sided: bool, tmp_path: Path) -> None:
    text, _ = written(tmp_path, Sphere(albedo=GREY, two_sided=two_sided))

    assert "pigment { rgb <0.5,0.25,0.125> } finish { ambient 0 diffuse 1 }" in text
    assert ("interior_texture { pigment { rgb 0 }" in text) is not two_sided


@pytest.mark.parametrize(
    ("clip", "expected"),
    [
        ("depth", "plane { -Forward, -vdot(Forward, Eye) - 0.5 } plane { Forward, vdot(Forward, Eye) + 20 }"),
        ("shell", "sphere { Eye, 0.5 inverse } sphere { Eye, 20 }"),
    ],
)
def test_what_is_clipped_away_still_casts_shadows(clip: str, expected: str, tmp_path: Path) -> None:
    text, _ = written(tmp_path, clip=clip)

    assert f"object {{ Solid0 clipped_by {{ {expected} }} no_shadow }}" in text
    assert "object { Solid0 no_image }" in text


def test_without_clipping_each_shape_is_there_once_and_a_far_one_is_told(tmp_path: Path) -> None:
    text, near = written(tmp_path, clip="none")
    _, far = written(tmp_path, Plane(albedo=GREY), clip="none")

    assert "object { Solid0 }" in text
    assert "no_image" not in text
    assert near == ()
    assert far == ("POV-Ray finds no hit farther than 1e+07 m along a ray",)
