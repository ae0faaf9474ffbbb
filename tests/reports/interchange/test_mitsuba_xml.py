"""Mitsuba XML in and out: the same picture from Mitsuba, the same scene back, and nothing left out in silence."""

from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import all_cases, select
from rayproof.cases.mesh_sandbox import LIMITS
from rayproof.cases.scene import Cube, Mesh, Scene, SceneError, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import ImportOptions, export_scene, import_scene

pytestmark = pytest.mark.process

HEAD = '<scene version="3.0.0">'
SENSOR = """<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/></film></sensor>"""
LIGHT = (
    '<emitter type="point"><point name="position" x="1" y="2" z="3"/><rgb name="intensity" value="2, 3, 4"/></emitter>'
)
BALL = '<shape type="sphere"/>'


def read(folder: Path, body: str):
    file = folder / "scene.xml"
    file.write_text(f"{HEAD}{body}</scene>")
    return import_scene(file)


def drawn(file: Path) -> np.ndarray:
    """Return Mitsuba's picture of a file: one path a pixel, through its centre."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    return np.array(mi.render(mi.load_file(str(file)), spp=1))


# One light: of several Mitsuba's integrator picks one at random.
ROUND_TRIPS = [
    case.name
    for case in select(["primitives", "transforms", "sidedness", "random_scenes"])
    if len(case.scene.lights) == 1 and case.scene.shading == "inverse_square"
]


@pytest.mark.references
@pytest.mark.parametrize("name", ROUND_TRIPS)
def test_export_import_export_draws_the_same_picture(name: str, tmp_path: Path) -> None:
    (case,) = select([name])
    once, twice = tmp_path / "once.xml", tmp_path / "twice.xml"

    export_scene(case.scene, once)
    imported = import_scene(once)
    export_scene(imported.scene, twice)

    first, second = drawn(once), drawn(twice)
    closed = Analytic().render(case.scene, [Stage.RADIANCE])[Stage.RADIANCE]
    assert (first.max() > 0) == (closed.max() > 0)
    # Matrices are multiplied by 2 and 0.5 and instances split and composed again: a few roundings of float64,
    # which may still move one float32 by an ulp, and a pixel that lies on an edge by all it is worth.
    differing = ~np.isclose(first, second, rtol=1e-5, atol=1e-6 * first.max()).all(axis=2)
    assert differing.mean() <= 0.001


@pytest.mark.references
def test_mitsuba_draws_an_export_as_the_closed_forms_do(tmp_path: Path) -> None:
    (case,) = select(["transforms/mesh_sheared"])
    export_scene(case.scene, tmp_path / "scene.xml")

    theirs, closed = drawn(tmp_path / "scene.xml"), Analytic().render(case.scene, [Stage.RADIANCE])[Stage.RADIANCE]

    differing = ~np.isclose(theirs, closed, rtol=1e-3, atol=1e-4 * closed.max()).all(axis=2)
    # Mitsuba computes in float32: outlines and shadow edges may fall on the other side.
    assert differing.mean() <= 0.02


def test_what_comes_back_are_the_shapes_that_went_out(tmp_path: Path) -> None:
    known = {case.name: case.scene for case in all_cases()}
    scene = next(s for s in known.values() if {Sphere, Cube, Square} <= {type(shape) for shape in s.shapes})
    export_scene(scene, tmp_path / "scene.xml")

    back = import_scene(tmp_path / "scene.xml").scene

    assert sorted(type(shape).__name__ for shape in back.shapes) == sorted(
        "Mesh" if type(shape).__name__ == "Triangle" else type(shape).__name__ for shape in scene.shapes
    )
    assert back.camera.fovy == pytest.approx(scene.camera.fovy, rel=1e-14)
    assert (back.camera.width, back.camera.height) == (scene.camera.width, scene.camera.height)
    for ours, theirs in zip(back.lights, scene.lights, strict=True):
        np.testing.assert_allclose(ours.flux, theirs.flux, rtol=1e-15)
        assert ours.position == theirs.position


def test_field_of_view_is_horizontal_unless_said_otherwise(tmp_path: Path) -> None:
    across = read(tmp_path, SENSOR + LIGHT + BALL).scene.camera
    sensor = SENSOR.replace("<float", '<string name="fov_axis" value="y"/><float', 1)
    upright = read(tmp_path, sensor + LIGHT + BALL).scene.camera

    assert np.tan(across.alpha) == pytest.approx(np.tan(np.radians(20)) / 2)
    assert upright.fovy == pytest.approx(40)


def test_intensity_becomes_flux(tmp_path: Path) -> None:
    (light,) = read(tmp_path, SENSOR + LIGHT + BALL).scene.lights

    assert light.position == (1, 2, 3)
    np.testing.assert_allclose(light.flux, 4 * np.pi * np.array([2, 3, 4]))


@pytest.mark.references
def test_a_spectrum_of_light_has_the_colour_that_mitsuba_gives_it(tmp_path: Path) -> None:
    body = LIGHT.replace('<rgb name="intensity" value="2, 3, 4"/>', '<spectrum name="intensity" value="5"/>')
    (light,) = read(tmp_path, SENSOR + body + BALL).scene.lights

    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    theirs = mi.traverse(mi.load_string(body.replace("<emitter", '<emitter version="3.0.0"', 1)))["intensity.value"]
    # Mitsuba integrates tables of the colour-matching functions; ours are their exact integrals.
    np.testing.assert_allclose(np.array(light.flux) / (4 * np.pi), np.array(theirs).ravel(), rtol=1e-4)


def test_groups_and_older_names_are_understood(tmp_path: Path) -> None:
    body = """<shape type="shapegroup" id="g"><shape type="sphere"><float name="radius" value="0.5"/></shape></shape>
      <shape type="instance"><ref id="g"/><transform name="toWorld"><translate x="1"/></transform></shape>
      <shape type="instance"><ref id="g"/><transform name="toWorld"><translate x="-1"/></transform></shape>"""
    (tmp_path / "scene.xml").write_text(
        f'<scene version="0.6.0">{SENSOR.replace("to_world", "toWorld")}{LIGHT}{body}</scene>'
    )

    scene: Scene = import_scene(tmp_path / "scene.xml").scene

    assert [shape.to_world[0][3] for shape in scene.shapes] == [1, -1]
    assert all(isinstance(shape, Sphere) and shape.radius == 0.5 for shape in scene.shapes)


def test_what_is_instanced_is_placed_in_its_group_and_then_with_it(tmp_path: Path) -> None:
    """A member's own matrix comes first: turned about the group's origin, and moved and stretched with the group."""
    body = """<shape type="shapegroup" id="g"><shape type="sphere"><transform name="to_world">
        <translate x="1" y="2"/><rotate z="1" angle="90"/></transform></shape></shape>
      <shape type="instance"><ref id="g"/><transform name="to_world"><scale x="3" y="1" z="1"/><translate z="5"/>
        </transform></shape>"""

    (ball,) = read(tmp_path, SENSOR + LIGHT + body).scene.shapes

    # (x, y, z) is moved to (x + 1, y + 2, z), turned to (-y - 2, x + 1, z), and brought to (-3 y - 6, x + 1, z + 5).
    expected = [(0, -3, 0, -6), (1, 0, 0, 1), (0, 0, 1, 5), (0, 0, 0, 1)]
    np.testing.assert_allclose(ball.to_world, expected, rtol=0, atol=1e-5)


def test_flipped_rectangles_face_the_other_way(tmp_path: Path) -> None:
    scene = read(
        tmp_path, SENSOR + LIGHT + '<shape type="rectangle"><boolean name="flip_normals" value="true"/></shape>'
    ).scene

    (square,) = scene.shapes
    normal = np.linalg.inv(np.array(square.to_world)[:3, :3]).T @ [0, 0, 1]
    assert normal[2] < 0
    assert isinstance(square, Square)


def test_meshes_are_read_from_beside_the_file_only(tmp_path: Path) -> None:
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    body = SENSOR + LIGHT + '<shape type="obj"><string name="filename" value="{}"/></shape>'

    (mesh,) = read(tmp_path, body.format("one.obj")).scene.shapes

    assert isinstance(mesh, Mesh)
    assert mesh.faces.shape == (1, 3)
    with pytest.raises(SceneError, match="must be a relative path inside"):
        read(tmp_path, body.format("../one.obj"))


@pytest.mark.parametrize(
    "around", ['<include filename="../other.xml"/>', '<path value=".."/><include filename="other.xml"/>']
)
def test_nothing_is_included_from_outside_of_the_folder(around: str, tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    (folder / "parts").mkdir(parents=True)
    for place in (tmp_path / "other.xml", folder / "parts" / "cube.xml"):
        place.write_text(f'{HEAD}<shape type="cube"/></scene>')

    imported = read(folder, SENSOR + LIGHT + '<include filename="parts/cube.xml"/>')

    assert [type(shape) for shape in imported.scene.shapes] == [Cube]
    with pytest.raises(SceneError, match="inside the scene's"):
        read(folder, SENSOR + LIGHT + around)


NOTHING = '<scale value="0"/></transform>'
DIFFUSE = '<shape type="cube"><bsdf type="diffuse">{}</bsdf></shape>'
LEFT_OUT = {
    "the shape cylinder": '<shape type="cylinder"/>',
    "the constant light": '<emitter type="constant"/>',
    "the area light of the shape": '<shape type="sphere"><emitter type="area"/></shape>',
    "plastic is taken as diffuse": '<shape type="sphere"><bsdf type="plastic"/></shape>',
    "the texture": DIFFUSE.format('<texture type="checkerboard" name="reflectance"/>'),
    "the integrator path": '<integrator type="path"/>',
    "flip_normals": '<shape type="sphere"><boolean name="flip_normals" value="true"/></shape>',
    "the int_ior of the plastic": DIFFUSE.replace("diffuse", "plastic").format('<float name="int_ior" value="1.5"/>'),
    "the phi_max of the sphere": '<shape type="sphere"><float name="phi_max" value="180"/></shape>',
    "the spectrum": DIFFUSE.format('<spectrum name="reflectance" value="400:0.2, 700:0.4"/>'),
}


@pytest.mark.parametrize("sentence", LEFT_OUT)
def test_what_is_left_out_is_told(sentence: str, tmp_path: Path) -> None:
    plain = read(tmp_path, SENSOR + LIGHT + BALL)
    told = read(tmp_path, SENSOR + LIGHT + BALL + LEFT_OUT[sentence])

    assert not plain.dropped
    assert any(sentence in dropped for dropped in told.dropped), told.dropped


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<scene", "XML"),
        ("not xml", "XML"),
        (f'{HEAD}<shape type="sphere"><float name="radius" value="-1"/></shape></scene>', "radius must be positive"),
        (f'{HEAD}<shape type="sphere"><ref id="nowhere"/></shape></scene>', "nowhere"),
        ('<bsdf version="3.0.0" type="diffuse"/>', "must hold a scene"),
        (f"{HEAD}{SENSOR.replace('40', '400')}</scene>", "fov must lie inside"),
        (f'{HEAD}<shape type="sphere"><string name="radius" value="wide"/></shape></scene>', "wide"),
        (f'{HEAD}<shape type="sphere"><string name="to_world" value="here"/></shape></scene>', "to_world"),
        (f"{HEAD}{SENSOR.replace('20', '0')}</scene>", "at least 1 x 1 px"),
        (f"{HEAD}{SENSOR.replace('</transform>', NOTHING)}</scene>", "to_world"),
    ],
)
def test_bad_files_end_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.xml").write_text(text)

    with pytest.raises(SceneError, match=message) as caught:
        import_scene(tmp_path / "bad.xml")

    assert "\n" not in str(caught.value)
    assert "bad.xml" in str(caught.value)


def test_a_parameter_of_the_sensor_that_has_no_say_is_told_and_none_of_the_film_s(tmp_path: Path) -> None:
    more = '<float name="shutter_open" value="1"/><film type="hdrfilm"><string name="pixel_format" value="rgb"/>'

    imported = read(tmp_path, SENSOR.replace('<film type="hdrfilm">', more) + LIGHT + BALL)

    assert [line.partition(": ")[2] for line in imported.dropped] == ["the shutter_open of the perspective"]


def test_a_file_of_which_no_shape_is_left_is_refused_and_says_what_was_left_out(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no shape of it can be read.*the shape cylinder"):
        read(tmp_path, SENSOR + LIGHT + '<shape type="cylinder"/>')


def test_another_folder_is_let_in_only_where_it_is_allowed(tmp_path: Path) -> None:
    folder, common = tmp_path / "scene", tmp_path / "common"
    for one in (folder, common):
        one.mkdir()
    (common / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (common / "cube.xml").write_text(f'{HEAD}<shape type="cube"/></scene>')
    (tmp_path / "secret.xml").write_text(f'{HEAD}<shape type="cube"/></scene>')
    mesh = '<shape type="obj"><string name="filename" value="one.obj"/></shape>'
    body = SENSOR + LIGHT + '<path value="../common"/><include filename="cube.xml"/>' + mesh

    with pytest.raises(SceneError, match=r"inside the scene's own.*--allow-folder"):
        read(folder, body)
    allowed = import_scene(folder / "scene.xml", ImportOptions(allowed=(common,)))

    assert [type(shape) for shape in allowed.scene.shapes] == [Cube, Mesh]
    (folder / "scene.xml").write_text(f'{HEAD}{body}<path value=".."/><include filename="secret.xml"/></scene>')
    with pytest.raises(SceneError, match="inside the scene's own"):
        import_scene(folder / "scene.xml", ImportOptions(allowed=(common,)))


def test_the_deepest_element_that_is_read_lies_as_deep_as_is_said(tmp_path: Path) -> None:
    def nested(levels: int) -> str:
        """Return a scene whose deepest element has so many around it, the scene itself among them."""
        wrapped = '<bsdf type="twosided">' * (levels - 2) + '<bsdf type="diffuse"/>' + "</bsdf>" * (levels - 2)
        return f'{SENSOR}{LIGHT}<shape type="sphere">{wrapped}</shape>'

    deepest = LIMITS["levels of nesting"]

    assert len(read(tmp_path, nested(deepest - 1)).scene.shapes) == 1
    with pytest.raises(SceneError, match=f"lies {deepest + 1} levels deep; at most {deepest} levels"):
        read(tmp_path, nested(deepest))
