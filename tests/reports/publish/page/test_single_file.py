"""report.html: everything in one file, which asks nobody for anything, in a real browser."""

import io
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest
from PIL import Image

from rayproof.cases.stages import Stage
from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page import page as module
from rayproof.reports.publish.page.page import write_single_file
from rayproof.reports.results.document import save_results
from rayproof.reports.results.images import read_answers
from tests.reports.publish.page.test_plots import CLIMB, leave
from tests.reports.publish.sample import make_folder
from tests.reports.publish.visits import Visit


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report in one file, of which nothing else is left; images/ is beside it for comparison only."""
    folder = tmp_path_factory.mktemp("run")
    results = make_folder(folder)
    results["cases"] = results["cases"][:2] + results["cases"][4:5]
    picture = folder / "pictures/sphere/sheared.png"
    picture.parent.mkdir(parents=True)
    Image.new("RGB", (8, 6), (10, 200, 30)).save(picture)
    results["cases"][1]["picture"] = picture.relative_to(folder).as_posix()
    save_results(folder, results)
    leave(folder, climbs=[CLIMB])
    publish_all(folder)
    place = tmp_path_factory.mktemp("mail")
    shutil.copytree(folder / "images", place / "images")
    write_single_file(folder, results).rename(place / "report.html")
    return place / "report.html"


@pytest.fixture
def page(browser: Any, alone: Path) -> Iterator[Any]:
    """Return a page at the file; a word on the console and a request are errors."""
    visit = Visit(browser, alone.parent, file=alone.name)
    yield visit.open()
    visit.end()
    assert {url.split("#")[0] for url in visit.requests if not url.startswith("data:")} <= {
        alone.as_uri(),
        "about:srcdoc",
    }


def go(page: Any, /, **address: str) -> None:
    """Open another address of the file."""
    page.goto(f"{page.url.split('#')[0]}#{urlencode(address)}")


@pytest.mark.process
def test_the_policy_names_texts_by_hash_and_no_place(alone: Path) -> None:
    text = alone.read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)

    assert policy is not None
    for word in ("unsafe", "self", "file:", "http"):
        assert word not in policy[1]
    assert policy[1].count("sha256-") == 7  # scripts: page, viewer, vtk.js, Plotly; styles: page, viewer, Plotly's
    assert "http:" not in text
    assert "https:" not in text
    assert "<img src=x" not in text


@pytest.mark.browser
def test_a_case_has_its_images_to_the_last_bit(page: Any, alone: Path) -> None:
    go(page, case="sphere/sheared", stage="normal", at="20,15")
    page.wait_for_selector(".inspector td[data-stage]")

    cell = page.locator('.inspector td[data-renderer="tracer-float32"][data-stage="normal"]')
    kept = read_answers(alone.parent / "images/sphere/sheared/tracer-float32.exr")[Stage.NORMAL][15, 20]
    assert np.array([np.float32(text) for text in cell.all_inner_texts()]).tobytes() == kept.tobytes()
    frame = np.asarray(Image.open(io.BytesIO(page.locator(".pane .frame > canvas").first.screenshot())).convert("RGB"))
    assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 20


@pytest.mark.browser
def test_it_holds_what_fails_and_the_worst_and_everything_on_request(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = make_folder(tmp_path, extra_cases=20)
    publish_all(tmp_path, results)
    held = re.compile(r'data-path="(data/[0-9]+\.js)"')

    few = write_single_file(tmp_path, results).read_text()
    visit = Visit(browser, tmp_path, file="report.html")
    page = visit.open()
    assert page.locator(".cases").get_attribute("aria-rowcount") == "30"
    assert page.locator(".thumbnails img").count() == few.count('data-path="thumbnails/')
    assert page.locator("summary", has_text="Contact sheet").count() == 1
    page = visit.open(case="more/case_019")
    assert page.locator(".command code").inner_text() == "rayproof report FOLDER --single-file --all"
    visit.end()
    whole = write_single_file(tmp_path, results, everything=True).read_text()
    assert (len(held.findall(few)), len(held.findall(whole))) == (10, 29)
    monkeypatch.setattr(module, "MOST_BYTES", len(few) - 50_000)
    tight = write_single_file(tmp_path, results).read_text()
    assert 0 <= len(held.findall(tight)) < 10
