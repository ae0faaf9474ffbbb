"""The 3-D view and the pages with plots in a real browser, from disk: pixels, points and rays, no error, no request."""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser
MAGENTA = np.array([230, 0, 126])  # the chosen pixel's ray


@pytest.fixture
def visit(browser: Any, everything: Path) -> Iterator[Visit]:
    """Return a visit to the report."""
    one = Visit(browser, everything)
    yield one
    one.end()


@pytest.fixture(scope="module")
def opened(browser: Any, everything: Path) -> Iterator[Any]:
    """Return a page with a case open in 3-D, for all tests that leave it as it was."""
    one = Visit(browser, everything)
    yield one.open_3d()
    one.end()


def photographed(page: Any) -> np.ndarray:
    """Return the 3-D view's pixels (height, width, 3), without its panel."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator("iframe").screenshot())).convert("RGB"))
    return picture[50:, 260:]


def test_the_view_is_drawn_and_its_layers_can_be_switched(opened: Any) -> None:
    boxes = opened.frame_locator("iframe").get_by_role("checkbox").all()

    full = photographed(opened)
    for box in boxes:
        box.uncheck()
    empty = photographed(opened)
    for box in boxes:
        box.check()

    assert len(np.unique(full.reshape(-1, 3), axis=0)) > 100
    assert (full != full[0, 0]).any(axis=-1).mean() > 0.05
    assert len(np.unique(empty.reshape(-1, 3), axis=0)) < 20


def test_the_points_take_the_colours_of_what_is_asked(opened: Any) -> None:
    page = opened
    frame = page.frame_locator("iframe")

    before = photographed(page)
    frame.get_by_label("measure").select_option("digits")
    assert "digits" in frame.locator(".scale").inner_text()
    frame.get_by_label("points coloured by").select_option("normal")

    assert (photographed(page) != before).any()


def test_a_pixel_shows_its_ray_and_a_point_marks_its_pixel(opened: Any) -> None:
    page = opened
    page.locator("figure canvas, .pane canvas, canvas").first.hover(position={"x": 60, "y": 60})
    page.wait_for_selector(".inspector h3:has-text('column')")
    page.wait_for_timeout(300)
    assert (np.abs(photographed(page).astype(int) - MAGENTA).max(axis=-1) < 40).sum() > 20
    box = page.locator("iframe").bounding_box()
    tip = page.frame_locator("iframe").locator("#tip")

    # Along a line through the middle there is a hit point somewhere.
    for step in range(200):
        page.mouse.move(box["x"] + 280 + step * 3, box["y"] + box["height"] * 0.55)
        if tip.is_visible():
            break
    column, row = re.findall(r"\d+", tip.inner_text())[:2]
    page.mouse.down()
    page.mouse.up()

    page.wait_for_selector(f".inspector h3:has-text('column {column}, row {row}')")


def test_words_of_strangers_are_not_heard(opened: Any) -> None:
    page = opened

    page.evaluate("window.postMessage({ token: '', kind: 'failed', why: 'nonsense' }, '*')")
    page.evaluate("frames[0].postMessage({ token: '', kind: 'scene', text: 'nonsense' }, '*')")
    page.wait_for_timeout(200)

    assert page.locator("iframe").count() == 1
    assert "nonsense" not in page.locator("main").inner_text()


def test_without_webgl_the_poster_stays_and_says_why(visit: Visit) -> None:
    visit.page.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
        " return kind.startsWith('webgl') ? null : get.call(this, kind, ...more); };"
    )
    page = visit.open(case="sphere/plain", stage="distance")

    page.get_by_role("button", name="open in 3-D").click()

    page.wait_for_selector(".scene :text('This browser offers no WebGL 2')")
    assert page.locator("iframe").count() == 0


def test_ladders_are_plotted_with_slopes_and_commands(visit: Visit) -> None:
    page = visit.open(page="stability", slot="sphere")
    page.wait_for_selector(".plot[data-drawn]")

    assert page.locator("h1").inner_text() == "1 ladder, 2 climbs, 0 known failures, 1 surprise"
    assert "1.0e+6" in page.locator(".breakpoints").inner_text()
    page.get_by_text("slopes and breakpoints").click()
    assert "1.02 [1, 1.1]" in page.locator(".ladder table").inner_text()
    point = page.locator(".plot .points path").first.bounding_box()
    page.mouse.move(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    page.wait_for_timeout(200)
    page.mouse.click(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    page.wait_for_selector(".ladder [role=status] code")
    command = page.locator(".ladder [role=status] code").inner_text()
    assert command.startswith("rayproof stability")
    assert command.endswith(" SPH-FAR --precision float32")


def test_a_hostile_name_is_text_in_plots_too(visit: Visit) -> None:
    page = visit.open(page="stability", slot="sphere")
    page.wait_for_selector(".plot[data-drawn]")

    assert page.locator(".plot a").count() == 0
    assert "<b>" in page.locator(".breakpoints").inner_text()


def test_error_against_time_is_plotted_and_its_points_say_where_they_come_from(visit: Visit) -> None:
    page = visit.open(page="tradeoff")
    page.wait_for_selector(".plot[data-drawn]")

    page.get_by_text("numbers", exact=True).click()
    page.get_by_role("button", name="haines, float32").click()

    assert "3.9 ns [1.9, 4.2] by kernel times" in page.locator(".ladder [role=status]").inner_text()
    assert page.get_by_role("link", name="cases of sphere").get_attribute("href") == "#family=sphere"
    assert page.locator(".ladder [role=status] code").inner_text() == "rayproof tradeoff sphere"


def test_references_tell_versions_settings_notes_and_who_is_absent(visit: Visit) -> None:
    page = visit.open(page="references")

    text = page.get_by_role("region", name="References").inner_text()
    for expected in (
        "numpy <b>2</b>",
        "ray epsilon",
        "0.001 m",
        "a disc for a plane (2 cases",
        "It is under test.",
        "cannot answer",
    ):
        assert expected in text
    assert "drjit" in page.get_by_role("region", name="Environment").inner_text()
    findings = page.get_by_role("region", name="Findings")
    assert findings.locator("tbody tr").count() == 2
    assert "normal, radiance" in findings.inner_text()
    assert findings.locator("code").inner_text() == "rayproof run 'examples/findings/<b>.json'"
    assert findings.get_by_role("link", name="sphere/plain").count() == 1
