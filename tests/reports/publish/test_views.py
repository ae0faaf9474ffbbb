"""The 3-D views: PyVista's scene as bytes, the same for the same scene, small, and made without OpenGL."""

import base64
import html
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.publish.page.viewer_page import SCRIPTS, digests_in_one, page, page_in_one, vendored
from rayproof.reports.publish.scene3d import gl
from rayproof.reports.publish.scene3d.picture_hits import Hits, chosen_hits, correct_digits
from rayproof.reports.publish.scene3d.pictures import draw_pictures
from rayproof.reports.publish.scene3d.view_file import pack, point_values
from tests.reports.publish.sample import answers, make_folder

MOST_BYTES = 120_000


def unpacked(view: Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return a view's header and arrays, as viewer/unpack.js has them."""
    (text,) = (json.loads(line.removesuffix("\n")) for line in view.read_text().splitlines() if line.startswith('"'))
    packed = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(packed[:4], "little")
    header, at, arrays = json.loads(packed[4 : 4 + length]), 4 + length, {}
    for name, size, words in header["arrays"]:
        part = np.frombuffer(packed[at : at + size], np.uint8)
        arrays[name] = part.reshape(4, -1)[::-1].T.tobytes() if words else part.tobytes()
        at += size
    return header, arrays


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Return a folder whose views were made on a machine that cannot draw."""
    folder = tmp_path_factory.mktemp("views")
    results = make_folder(folder)
    results["cases"] = results["cases"][1:3]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gl, "why_not", lambda: "OpenGL is missing")
        assert draw_pictures(folder, results) == "OpenGL is missing"
    return folder, results


@pytest.mark.process
def test_views_are_made_without_opengl_and_pictures_are_not(drawn) -> None:
    folder, results = drawn

    for case in results["cases"]:
        assert case["picture"] is None
        assert 5_000 < (folder / case["view"]).stat().st_size < MOST_BYTES


@pytest.mark.process
def test_a_view_holds_the_named_parts_and_finite_points(drawn) -> None:
    folder, results = drawn

    header, arrays = unpacked(folder / results["cases"][1]["view"])

    layers = {layer for _, layer in header["about"]["parts"]}
    assert {"geometry", "camera", "rays", "points", "lights", "normals, ours", "normals, reference", "pixel"} <= layers
    assert {"feelers, lit", "feelers, blocked"} & layers
    assert header["about"]["colored"] == "visibility"
    (renderer,) = header["scene"]["dependencies"]
    assert sum(call[0] == "addViewProp" for call in renderer["calls"]) == len(header["about"]["parts"])
    points = [np.frombuffer(arrays[name], np.float32) for name in arrays if name.endswith("f")]
    assert all(np.isfinite(values).all() and np.abs(values).max(initial=0) < 25 for values in points)


@pytest.mark.process
def test_the_same_scene_gives_the_same_bytes(drawn, tmp_path) -> None:
    folder, results = drawn
    again = make_folder(tmp_path)
    again["cases"] = again["cases"][1:2]

    draw_pictures(tmp_path, again)

    first, second = folder / results["cases"][0]["view"], tmp_path / again["cases"][0]["view"]
    assert first.read_bytes() == second.read_bytes()


def test_packing_keeps_every_bit() -> None:
    values = np.random.default_rng(1).normal(size=7).astype(np.float32)

    packed = zlib.decompress(base64.b64decode(pack({"about": 1}, {"a": values, "b": np.arange(3, dtype=np.uint8)})))

    length = int.from_bytes(packed[:4], "little")
    body = np.frombuffer(packed[4 + length :], np.uint8)
    assert body[:28].reshape(4, 7)[::-1].T.tobytes() == values.tobytes()
    assert body[28:].tolist() == [0, 1, 2]


def test_the_worst_pixels_are_among_the_points() -> None:
    ours = answers(width=80, height=60)
    error = np.zeros((60, 80))
    row, column = np.argwhere(ours[Stage.OBJECT][..., 0] >= 0)[1234]
    error[row, column] = 1.0

    hits = chosen_hits(ours, None, error)

    assert hits is not None
    assert (row, column) in set(zip(hits.rows.tolist(), hits.columns.tolist(), strict=True))


def test_exact_and_undefined_errors_are_told_apart() -> None:
    theirs = {Stage.NORMAL: np.ones((1, 4, 3))}
    ours = {Stage.NORMAL: np.array([[[1, 1, 1], [1, 1.001, 1], [1, np.nan, 1], [1, 1, np.inf]]])}
    hits = Hits(rows=np.zeros(4, int), columns=np.arange(4), points=np.zeros((4, 3)), normals=np.ones((4, 3)))

    values = point_values(hits, ours, theirs)

    assert values["pixels"] == [[0, 0], [1, 0], [2, 0], [3, 0]]
    assert values["stages"]["normal"]["error"] == [None, -300, "nan", "nan"]
    assert values["stages"]["normal"]["digits"] == [None, 300, "nan", "nan"]
    assert np.isinf(correct_digits(ours, theirs, Stage.NORMAL)[0, 0])


def test_the_viewer_holds_every_script_and_no_address() -> None:
    folder = Path(gl.__file__).with_name("viewer")

    assert {path.stem for path in folder.glob("*.js")} == set(SCRIPTS)
    assert all(f"'{digest}'" in html.unescape(page_in_one()) for digests in digests_in_one() for digest in digests)
    assert "http:" not in page()
    assert "https:" not in page()
    assert "unsafe" not in page()
    assert "</script" not in vendored("vtk-viewer.js")
