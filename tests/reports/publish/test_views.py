"""What is shown in 3-D: the page makes the same parts as the stills, and its viewer draws what PyVista draws."""

import html
import io
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from PIL import Image

from rayproof.cases.placement import scaling, shear
from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.scene_json import load_scene, scene_from_json, scene_to_json, unpack
from rayproof.cases.stages import Stage
from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.case_data import SCRIPTS, digests_in_one, page, page_in_one, vendored
from rayproof.reports.publish.page.case_data import view_of as shown_of
from rayproof.reports.publish.scene3d import stills
from rayproof.reports.publish.scene3d.parts import ball, look, view_of
from rayproof.reports.results.document import save_results
from tests.reports.publish.modules import REVIVE, image
from tests.reports.publish.sample import SCENE, answers, make_folder
from tests.reports.publish.visits import Visit

FACES = 80_000
MADE = f"""async ([scene, look, images, stages, stage]) => {{ {REVIVE}
    const get = async (renderer, name) => images[renderer]?.[name] ? revive(images[renderer][name]) : null;
    const view = await rayproof.sceneParts({{ scene, ours: "ours", theirs: "theirs", stage }}, stages, get, look);
    const list = (values) => values && Array.from(values);
    return {{ ...view, parts: view.parts.map((part) => ({{ ...part,
        points: list(part.points), cells: list(part.cells), normals: list(part.normals) }})) }};
}}"""


def sample() -> Scene:
    """Return the sample's scene."""
    return scene_from_json(SCENE, folder=None, where="the sample")


def of_all_shapes() -> Scene:
    """Return a scene of every shape, mirrored and sheared, and of more lights than are drawn, one of them far away."""
    grey, corners = (0.5, 0.25, 1.5), ((0.0, 0.0, 2.0), (1.0, 0.0, 2.0), (0.0, 1.0, 2.5))
    vertices = np.asarray([*corners, (1.0, 1.0, 2.0)], np.float32)
    shapes = (
        Sphere(albedo=grey, center=(0.5, 0.0, 0.0), radius=0.8, to_world=scaling(-1, 1, 2)),
        Cube(albedo=grey, to_world=shear(xy=0.3, xz=0.1)),
        Square(albedo=grey, to_world=scaling(2, 1, 1)),
        Triangle(albedo=grey, vertices=corners),
        Mesh(albedo=grey, vertices=vertices, faces=np.asarray([[0, 1, 2], [1, 3, 2]], np.int32)),
        Plane(albedo=grey, to_world=((1, 0, 0, 0), (0, 3, 0, 0), (0, 0, 1, -1), (0, 0, 0, 1))),
        Sphere(albedo=grey, radius=50.0),  # around the camera
    )
    lights = [PointLight(position=(float(n % 7), 3.0, float(n // 7)), flux=(1.0, 1.0, 1.0)) for n in range(80)]
    lights[0] = PointLight(position=(0.0, 1e7, 0.0), flux=(1.0, 1.0, 1.0))
    return replace(sample(), shapes=shapes, lights=tuple(lights))


def spoilt(stage: Stage) -> dict[Stage, np.ndarray]:
    """Return the sample's answers with a stage wrong in a few pixels, one of which has no number."""
    ours = answers(rounding=1e-7)
    ours[stage][12:14, 15:25] *= 1.1
    ours[stage][15, 20] = np.nan
    return ours


@pytest.mark.browser
@pytest.mark.parametrize(
    ("scene", "blamed", "known"),
    [
        pytest.param(sample(), Stage.NORMAL, True, id="blamed"),
        pytest.param(sample(), None, True, id="nothing blamed"),
        pytest.param(sample(), None, False, id="no images"),
        pytest.param(of_all_shapes(), Stage.DISTANCE, True, id="all shapes"),
        pytest.param(of_all_shapes(), None, False, id="all shapes, no images"),
        pytest.param(
            replace(sample(), camera=replace(sample().camera, eye=(300.0, -400.0, 90.0))), None, True, id="from afar"
        ),
    ],
)
def test_the_page_makes_the_parts_of_the_stills(run: Any, scene: Scene, blamed: Stage | None, known: bool) -> None:
    images = {"ours": spoilt(blamed or Stage.RADIANCE), "theirs": answers()} if known else {}
    images = {name: {stage: np.float32(values) for stage, values in own.items()} for name, own in images.items()}
    if len(scene.lights) != 2:
        images = {name: {**own, Stage.VISIBILITY: np.ones((30, 40, 80), np.float32)} for name, own in images.items()}
    stages = [stage.value for stage in Stage if known and stage in images["ours"]]
    told = {name: {stage.value: image(values) for stage, values in own.items()} for name, own in images.items()}

    made = run(
        MADE, [scene_to_json(scene, packed=1), msgspec.to_builtins(look()), told, stages, blamed and blamed.value]
    )
    expected = view_of(scene, images.get("ours"), images.get("theirs"), blamed)

    assert [part["name"] for part in made["parts"]] == [part.name for part in expected.parts]
    assert made["middle"] == pytest.approx(expected.middle, rel=1e-12, abs=1e-12)
    assert made["size"] == pytest.approx(expected.size, rel=1e-12)
    assert made["colored"] == expected.colored
    for mine, part in zip(made["parts"], expected.parts, strict=True):
        assert (mine["layer"], mine["opacity"], mine["edges"]) == (part.layer, part.opacity, part.edges)
        assert (mine["color"] or [None])[0] == part.color
        assert mine["cells"] == part.cells.ravel().tolist()
        assert mine["corners"] == part.cells.shape[1]
        # Both are rounded to float32, of coordinates of about 1 that are the same to a few roundings of float64.
        np.testing.assert_allclose(mine["points"], part.points.ravel(), rtol=2**-23, atol=1e-12, err_msg=part.name)
        assert (mine["normals"] is None) == (part.normals is None)
        if part.normals is not None:
            np.testing.assert_allclose(mine["normals"], part.normals.ravel(), rtol=2**-23, atol=1e-12)


@pytest.mark.parametrize(
    "broken", [{"vertices": "x"}, {"faces": None}, {"faces": [[0, 1]]}, {"vertices": [[1e999] * 3] * 2}]
)
def test_a_mesh_that_is_none_costs_its_view_and_not_the_report(broken: dict[str, Any]) -> None:
    mesh = {"type": "mesh", "vertices": [[0.1, 0, 0]] * 3, "faces": [[0, 1, 2]]}
    case: Any = {"renders": [], "stage": None}

    (shape,) = shown_of({"camera": {}, "shapes": [mesh]}, case)["scene"]["shapes"]
    assert unpack(shape["vertices"], "<f4")[0].tolist() == [np.float32(0.1), 0, 0]
    assert shown_of({"camera": {}, "shapes": [mesh | broken]}, case) is None


def test_the_viewer_holds_every_script_and_no_address() -> None:
    folder = Path(stills.__file__).with_name("viewer")

    assert {path.stem for path in folder.glob("*.js")} == set(SCRIPTS)
    assert all(f"'{digest}'" in html.unescape(page_in_one()) for digests in digests_in_one() for digest in digests)
    assert "http:" not in page()
    assert "https:" not in page()
    assert "unsafe" not in page()
    assert "</script" not in vendored("vtk-viewer.js")


CASES = {"sphere": "sphere/plain", "plane": "plane/tilted", "mesh": "more/case_000", "failing": "sphere/sheared"}


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report of a sphere, a plane, a mesh and a failing case, with stills where there is OpenGL."""
    folder = tmp_path_factory.mktemp("views")
    results = make_folder(folder, extra_cases=1, width=160, height=120)
    results["cases"] = [case for case in results["cases"] if case["name"] in CASES.values()]
    fine = ball(284)
    faces = np.concatenate([fine.cells[:, [0, 1, 2]], fine.cells[:, [0, 2, 3]]]).astype(np.int32)
    assert len(faces) > FACES
    mesh = Mesh(albedo=(0.2, 0.6, 0.3), vertices=fine.points.astype(np.float32), faces=faces)
    shapes = {
        CASES["sphere"]: lambda scene: scene.shapes[:1],
        CASES["plane"]: lambda scene: scene.shapes[1:],
        CASES["mesh"]: lambda _: (mesh,),
    }
    for case in results["cases"]:
        path = folder / case["scene"]
        scene = load_scene(path)
        chosen = shapes.get(case["name"], lambda scene: scene.shapes)(scene)
        path.write_text(json.dumps(scene_to_json(replace(scene, shapes=chosen))))
    if stills.why_not() is None:
        stills.draw_stills(folder, results["cases"], results["cases"])
    save_results(folder, results)
    publish_all(folder)
    return folder


@pytest.fixture
def visit(browser: Any, drawn: Path) -> Iterator[Visit]:
    """Return a visit to that report."""
    one = Visit(browser, drawn, color_scheme="light")
    yield one
    one.end()


@pytest.mark.browser
@pytest.mark.process
@pytest.mark.parametrize("kind", CASES)
def test_the_view_shows_what_the_still_shows(visit: Visit, drawn: Path, kind: str) -> None:
    page = visit.open(case=CASES[kind])
    # A frame of the still's size, in whole pixels of the window, without the panel over it.
    page.evaluate(
        "document.styleSheets[0].insertRule('.stage3d .frame3d { position: fixed !important; left: 0; top: 0;"
        " z-index: 9; width: 602px !important; height: 452px !important }', document.styleSheets[0].cssRules.length)"
    )
    page.get_by_role("button", name="open in 3-D").click()
    page.wait_for_selector("iframe[data-drawn]")
    page.frames[1].evaluate("document.getElementById('panel').hidden = true")
    view = np.asarray(Image.open(io.BytesIO(page.locator("iframe").screenshot())).convert("RGB"))[1:-1, 1:-1]

    if (why := stills.why_not()) is not None:
        pytest.skip(why)
    still = np.asarray(Image.open(drawn / "pictures" / f"{CASES[kind]}.png").convert("RGB"))

    assert view.shape == still.shape == (*reversed(look().still), 3)
    # Not where the page has a button and the still its bar of colours.
    both = np.stack([view, still])[:, 50:370].astype(int)
    background = np.array([int(look().background[0][at : at + 2], 16) for at in (1, 3, 5)])
    shown = np.abs(both - background).max(axis=-1) > 8
    assert (shown[0] & shown[1]).sum() > 0.93 * (shown[0] | shown[1]).sum() > 5000
    assert (np.abs(both[0] - both[1]).max(axis=-1) < 16).mean() > 0.9
    for layer in ("camera", "lights", "rays"):
        color = np.array([int(look().layers[layer].color[0][at : at + 2], 16) for at in (1, 3, 5)])
        here, there = (np.abs(both - color).max(axis=-1) < 12).sum(axis=(1, 2))
        assert here == pytest.approx(there, rel=0.3)
        assert here > 30
