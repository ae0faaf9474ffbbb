"""Mitsuba XML in and out: the same picture from Mitsuba, the same scene back, and nothing left out in silence."""

from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import all_cases, select
from rayproof.cases.scene import Cube, Mesh, SceneError, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import ImportOptions, export_scene, import_scene, mitsuba_document

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


# Materials and shapes as Mitsuba's own picture has them


TURNS = [
    (scale, flipped, instanced)
    for scale in ((1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1))
    for flipped in (False, True)
    for instanced in (False, True)
]
QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"


@pytest.mark.references
@pytest.mark.parametrize("kind", ["sphere", "cube", "rectangle", "disk", "plain.obj", "normals.obj", "normals.ply"])
def test_a_mirrored_one_sided_shape_is_lit_from_the_side_that_mitsuba_lights(kind: str, tmp_path: Path) -> None:
    (tmp_path / "plain.obj").write_text(f"{QUAD}f 1 2 3\nf 1 3 4\n")
    (tmp_path / "normals.obj").write_text(f"{QUAD}vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n")
    numbers = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    rows = "".join(f"{line[2:]} 0 0 1\n" for line in QUAD.splitlines())
    (tmp_path / "normals.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 4\n{numbers}element face 2\n"
        f"property list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n3 0 2 3\n"
    )
    name, _, suffix = kind.partition(".")
    file = f'<string name="filename" value="{kind}"/>' if suffix else ""
    for (x, y, z), flipped, instanced in TURNS:
        turn = f'<transform name="to_world"><scale x="{x}" y="{y}" z="{z}"/></transform>'
        flip = f'<boolean name="flip_normals" value="{str(flipped).lower()}"/>'
        plain = f'<shape type="{suffix or name}">{file}{flip}{"" if instanced else turn}</shape>'
        group = f'<shape type="shapegroup" id="g">{plain}</shape><shape type="instance"><ref id="g"/>{turn}</shape>'
        # The light and the eye are on the same side of everything that they see.
        imported = read(tmp_path, SENSOR + DIRECT + LIGHT.replace('z="3"', 'z="6"') + (group if instanced else plain))

        radiance = Analytic().render(imported.scene, [Stage.RADIANCE])[Stage.RADIANCE]
        assert (radiance[10, 20, 0] > 0) == (drawn(tmp_path / "scene.xml")[10, 20, 0] > 0), (kind, x, y, z, flipped)


DIRECT = '<integrator type="direct"/>'
CENTRES = '<sampler type="stratified"><integer name="sample_count" value="1"/>'
CENTRES += '<boolean name="jitter" value="false"/></sampler>'


INNER = '<rgb name="reflectance" value="0.1, 0.2, 0.3"/>'
WRAPPED = {
    "mask": f'<bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="diffuse">{INNER}</bsdf></bsdf>',
    "bumpmap": f'<bsdf type="bumpmap"><texture type="checkerboard"/><bsdf type="diffuse">{INNER}</bsdf></bsdf>',
    "normalmap": f'<bsdf type="normalmap"><texture type="bitmap" name="n"/><bsdf type="diffuse">{INNER}</bsdf></bsdf>',
}


@pytest.mark.parametrize("name", WRAPPED)
@pytest.mark.parametrize("outside", [True, False])
def test_a_wrapped_material_keeps_its_colour_and_its_two_sides(name: str, outside: bool, tmp_path: Path) -> None:
    two = '<bsdf type="twosided">{}</bsdf>'
    inside = WRAPPED[name].replace('<bsdf type="diffuse">', '<bsdf type="twosided"><bsdf type="diffuse">')
    whole = two.format(WRAPPED[name]) if outside else inside.replace(INNER, f"{INNER}</bsdf>")

    for material, two_sided in ((whole, True), (WRAPPED[name], False)):
        imported = read(tmp_path, SENSOR + LIGHT + f'<shape type="sphere">{material}</shape>')
        (ball,) = imported.scene.shapes
        assert (ball.albedo, ball.two_sided) == ((0.1, 0.2, 0.3), two_sided)
        assert len(imported.dropped) == 1, imported.dropped


@pytest.mark.references
def test_spectra_become_the_colours_that_mitsuba_integrates(tmp_path: Path) -> None:
    import mitsuba as mi

    # Two walls and the lamp of the Cornell box, shortened (Cornell University Program of Computer Graphics).
    walls = (
        "400:0.06, 500:0.06, 580:0.06, 620:0.5, 700:0.64",
        "400:0.1, 460:0.12, 520:0.4, 580:0.28, 640:0.14, 700:0.12",
    )
    lamp = '<spectrum name="intensity" value="400:0, 500:8, 600:15.6, 700:18.4"/>'
    light = LIGHT.replace('<rgb name="intensity" value="2, 3, 4"/>', lamp)
    body = "".join(DIFFUSE.format(f'<spectrum name="reflectance" value="{wall}"/>') for wall in walls)

    scene = read(tmp_path, SENSOR + light + body).scene

    mi.set_variant("scalar_rgb")
    theirs = mi.traverse(mi.load_file(str(tmp_path / "scene.xml")))
    colours = [np.array(value).ravel() for _, value in theirs if np.size(value) == 3]
    red, green = (shape.albedo for shape in scene.shapes)
    assert red[0] > 3 * max(red[1:])
    assert green[1] > 1.5 * max(green[0], green[2])
    for ours in (red, green, tuple(np.array(scene.lights[0].flux) / (4 * np.pi))):
        assert any(np.allclose(ours, value, rtol=1e-5) for value in colours), (ours, colours)


# Parameters, names and other programs' files


def test_parameters_are_set_from_outside(tmp_path: Path) -> None:
    body = '<default name="size" value="2"/><shape type="sphere"><float name="radius" value="$size"/></shape>'
    (tmp_path / "scene.xml").write_text(f"{HEAD}{SENSOR}{LIGHT}{body}</scene>")

    for parameters, radius in (({}, 2), ({"size": "3"}, 3)):
        (ball,) = import_scene(tmp_path / "scene.xml", ImportOptions(parameters=parameters)).scene.shapes
        assert isinstance(ball, Sphere)
        assert ball.radius == radius
    for parameters, word in (({"sise": "3"}, "sise"), ({"filename": "3"}, "no parameter that is called filename")):
        with pytest.raises(SceneError, match=word) as caught:
            import_scene(tmp_path / "scene.xml", ImportOptions(parameters=parameters))
        assert "\n" not in str(caught.value)


def test_names_lead_upward_into_allowed_folders_and_nowhere_else(tmp_path: Path) -> None:
    folder, common = tmp_path / "scene", tmp_path / "common"
    folder.mkdir()
    common.mkdir()
    for place in (common, tmp_path):
        (place / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        (place / "cube.xml").write_text(f'{HEAD}<shape type="cube"/></scene>')
    body = SENSOR + LIGHT + '<include filename="{0}/cube.xml"/>'
    body += '<shape type="obj"><string name="filename" value="{0}/one.obj"/></shape>'

    with pytest.raises(SceneError, match=r"\.\./common/cube\.xml.*--allow-folder"):
        read(folder, body.format("../common"))
    allowed = import_scene(folder / "scene.xml", ImportOptions(allowed=(common,)))

    assert [type(shape) for shape in allowed.scene.shapes] == [Cube, Mesh]
    for outside in ("..", "../common/.."):
        (folder / "scene.xml").write_text(f"{HEAD}{body.format(outside)}</scene>")
        with pytest.raises(SceneError, match="must be a relative path inside"):
            import_scene(folder / "scene.xml", ImportOptions(allowed=(common,)))


def test_a_spectrum_is_read_from_beside_the_file_only(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    for place, level in ((folder, 0.25), (tmp_path, 0.5)):
        (place / "grey.spd").write_text(f"400 {level}\n700 {level}\n")
    body = SENSOR + LIGHT + DIFFUSE.format('<spectrum name="reflectance" filename="{}"/>')

    (cube,) = read(folder, body.format("grey.spd")).scene.shapes

    assert cube.albedo == pytest.approx((0.25, 0.25, 0.25), rel=0.01)
    for outside in ("../grey.spd", str(tmp_path / "grey.spd"), "/etc/passwd"):
        with pytest.raises(SceneError, match="must be a relative path inside") as caught:
            read(folder, body.format(outside))
        assert "0.5" not in str(caught.value)
        assert "root:" not in str(caught.value)


def test_a_parser_that_takes_too_long_or_dies_is_one_line_and_the_next_file_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read(tmp_path, SENSOR + LIGHT + BALL)
    monkeypatch.setattr(mitsuba_document, "MEMORY", 0)
    monkeypatch.setattr(mitsuba_document, "MEMORY_A_BYTE", 0)
    with pytest.raises(
        SceneError, match=r"scene.xml: Mitsuba's parser failed: it took more than 0 GiB of memory"
    ) as caught:
        read(tmp_path, SENSOR + LIGHT + BALL * 5000)
    assert "\n" not in str(caught.value)
    monkeypatch.undo()

    assert len(read(tmp_path, SENSOR + LIGHT + BALL).scene.shapes) == 1
