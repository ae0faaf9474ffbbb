"""A results folder of somebody else's brings data, never a script: what the page runs is written anew or not named."""

import base64
import json
import re
import zlib
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.publish.page.case_data import clean_pixels
from rayproof.reports.results.document import save_results
from rayproof.reports.results.float_codec import inflated, pack
from rayproof.reports.results.images import handed_over, read_pixels, script, write_pixels
from tests.reports.publish.sample import SCENE, answers, make_folder

ATTACK = "alert(document.cookie)"


@pytest.fixture
def pixels(tmp_path: Path) -> Path:
    """Return a case's images as a run writes them."""
    renders = {"analytic": answers(), "tracer-float32": answers(rounding=1e-7)}
    return write_pixels(tmp_path / "a.js", "a.js", renders, SCENE)


def test_what_a_run_wrote_stays_as_it_is(pixels: Path) -> None:
    before = pixels.read_bytes()

    assert clean_pixels(pixels.parent, "a.js") is None
    assert pixels.read_bytes() == before


def test_code_around_the_data_is_gone(pixels: Path) -> None:
    images = read_pixels(pixels)
    text = pixels.read_text()
    pixels.write_text(text.replace("rayproof.receive(", f"{ATTACK};rayproof.receive(", 1) + f"\n{ATTACK}\n")

    assert clean_pixels(pixels.parent, "a.js") is None
    assert pixels.read_text() == text
    assert set(read_pixels(pixels)) == set(images)


def changed(path: Path, **members: object) -> None:
    content = json.loads(handed_over(path.read_text()))
    content["renderers"]["analytic"]["ray"] |= members
    path.write_text(script("a.js", content))


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"width": 10**9}, "must pack"),
        ({"height": True}, "height must be of type int"),
        ({"data": pack(bytes(10**7))}, "packs more"),
        ({"data": "@"}, "cannot be unpacked"),
        ({"by": [ATTACK]}, "by must be of type str"),
        ({"of": ATTACK}, "of must be a stage"),
        ({"rays": [[ATTACK]]}, "must hold numbers"),
    ],
)
def test_images_that_are_none_are_not_named(pixels: Path, members: dict[str, object], said: str) -> None:
    changed(pixels, **members)

    why = clean_pixels(pixels.parent, "a.js")

    assert why is not None
    assert said in why
    assert "\n" not in why


def test_no_more_is_unpacked_than_there_should_be() -> None:
    bomb = base64.b64encode(zlib.compress(bytes(10**8))).decode()

    with pytest.raises(ValueError, match="packs more"):
        inflated(bomb, 100)


def test_a_stranger_s_folder_runs_nothing_of_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = make_folder(tmp_path)
    (tmp_path / "images" / "evil.js").write_text(ATTACK)
    results["cases"][0] |= {"pixels": "images/evil.js", "view": "images/evil.js"}
    save_results(tmp_path, results)

    assert main(["report", str(tmp_path)]) == 0

    capsys.readouterr()
    named = {
        name
        for path in (tmp_path / "data").glob("*.js")
        if not path.name.endswith("pixels.js")
        for name in re.findall(r'"(?:pixels|view)":"([^"]*)"', unpacked(path))
    }
    assert "images/evil.js" not in named


def unpacked(path: Path) -> str:
    return zlib.decompress(base64.b64decode(json.loads(handed_over(path.read_text())))).decode()
