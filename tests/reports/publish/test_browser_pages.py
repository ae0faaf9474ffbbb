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
