"""A case in a real browser, from disk: every tab, every mode, every float as in the EXR files."""

from typing import Any

import numpy as np
import pytest

from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.results.files import legible
from rayproof.reports.results.images import read_answers
from tests.reports.publish.sample import HOSTILE

pytestmark = pytest.mark.browser

# What one layer of a pane shows at a pixel, whatever the zoom.
LAYER = """([pane, layer, x, y]) => Array.from(document.querySelectorAll('.pane .frame > canvas')[pane]
    .layers[layer].bitmap.getContext('2d').getImageData(x, y, 1, 1).data.slice(0, 3))"""


def opened(visit: Any, **address: Any) -> Any:
    """Open a case and return the page once images are there."""
    page = visit.open(**address)
    page.wait_for_selector(".pane .frame > canvas")
    return page


def hover(page: Any, column: int, row: int, *, width: int = 40, height: int = 30) -> None:
    """Point at a pixel of the first image."""
    canvas = page.locator(".pane .frame > canvas").first
    box = canvas.bounding_box()
    scale = min(box["width"] / width, box["height"] / height)
    left, top = (box["width"] - width * scale) / 2, (box["height"] - height * scale) / 2
    canvas.hover(position={"x": left + (column + 0.5) * scale, "y": top + (row + 0.5) * scale})
    page.wait_for_selector(f".inspector h3:has-text('column {column}, row {row}')")


def test_a_case_opens_at_the_stage_that_is_blamed_and_goes_back_to_the_filtered_list(visit):
    page = visit.open(verdict="fail")

    page.locator(".cases").get_by_role("link", name="sphere/sheared").click()
    page.wait_for_selector(".pane .frame > canvas")
    assert page.get_by_role("tab", selected=True).inner_text().split()[1] == "normal"
    assert page.locator(".pane .frame > canvas").count() >= 3
    assert "rayproof run sphere/sheared" in page.locator(".case-head .command").inner_text()
    page.keyboard.press("Escape")
    page.wait_for_selector(".cases")
    assert len(visit.names()) == 3


@pytest.mark.parametrize("reference", ["analytic", "mitsuba_scalar"])
def test_the_inspector_shows_the_floats_of_the_files_bit_for_bit(visit, published, reference):
    page = opened(visit, case="lights/broken", stage="radiance", reference=reference)
    names = ("tracer-float32", "tracer-float64", "analytic", "mitsuba_scalar")
    images = {name: read_answers(published.folder / f"images/lights/broken/{name}.exr") for name in names}

    # A corner, the NaN, the infinity, the middle, the last pixel.
    for column, row in ((0, 0), (3, 2), (5, 4), (20, 15), (39, 29)):
        hover(page, column, row)
        cells = page.evaluate(
            "Array.from(document.querySelectorAll('.inspector td[data-stage]'), (cell) =>"
            " [cell.dataset.renderer, cell.dataset.stage, Number(cell.dataset.channel), cell.textContent])"
        )
        assert len(cells) == 4 * sum(len(exr_channels(stage, lights=2)) for stage in images["analytic"])
        for renderer, stage, channel, text in cells:
            if stage in images[renderer]:
                expected, found = images[renderer][stage][row, column, channel], np.float32(text)
                assert found.tobytes() == expected.tobytes() or (np.isnan(found) and np.isnan(expected))
            else:
                assert text == ""


def test_the_error_is_that_of_float64_numpy(visit, published):
    page = opened(visit, case="sphere/sheared", stage="normal")
    ours, theirs = (
        read_answers(published.folder / f"images/sphere/sheared/{name}.exr")[Stage.NORMAL].astype(np.float64)
        for name in ("tracer-float32", "analytic")
    )
    difference = np.abs(ours - theirs).max(axis=-1)
    row, column = np.unravel_index(int(difference.argmax()), difference.shape)

    note = page.locator("figure:has-text('absolute error') figcaption").inner_text()

    assert f"at {column}, {row} " in note
    assert f"{np.count_nonzero(difference)} of {difference.size} pixels differ" in note
    assert f"largest error of a channel {difference.max():.3g} " in note.replace("e-0", "e-")


def test_the_limit_is_marked_and_the_range_can_be_chosen(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    assert page.locator(".histogram .limit").count() == 1
    assert page.locator(".limit-mark").count() == 1
    assert "pixels beyond 5.30e-7, the limit of the deciding pixel" in page.locator(".histogram").inner_text()
    before = page.evaluate(LAYER, [2, 0, 20, 15])

    page.get_by_label("high end of the range").fill("1")
    page.get_by_label("high end of the range").press("Enter")

    page.wait_for_selector(".scale input[aria-label^=high]")
    assert "high=1" in page.url
    assert page.evaluate(LAYER, [2, 0, 20, 15]) != before
    page.get_by_role("button", name="to limit").click()
    assert page.get_by_label("high end of the range").input_value() == "5.30e-7"
    page.get_by_role("button", name="auto").click()
    assert page.evaluate(LAYER, [2, 0, 20, 15]) == before
    page.get_by_label("error", exact=True).select_option("ulp")
    assert page.locator(".histogram .limit").count() == 0


def test_explained_pixels_of_one_configuration_are_not_shown_over_anothers_images(visit):
    page = opened(visit, case="sphere/sheared", stage="normal", ours="tracer-float64", explained="1")

    assert page.evaluate("rayproof.address().ours") == "tracer-float64"
    assert page.locator(".explained-control").count() == 0
    hover(page, 20, 10)
    assert page.locator(".kinds").inner_text() == ""


def test_everybody_is_shown_against_everybody_and_who_stands_alone(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")

    panel = page.get_by_role("region", name="Everybody against everybody")

    assert "float32 stands alone against <three> others." in panel.inner_text()
    assert panel.locator("tr.alone").inner_text().split()[0] == "float32"
    assert panel.locator("td.over").count() == 6


def test_a_link_shows_the_same_case_stage_mode_and_pixel_again(visit):
    page = opened(visit, case="lights/broken", stage="irradiance", mode="swipe", metric="ulp", at="7,9", explained="1")

    page.wait_for_selector(".inspector h3:has-text('column 7, row 9')")
    assert page.locator("[data-mode=swipe]").get_attribute("aria-checked") == "true"
    assert page.get_by_label("error", exact=True).input_value() == "ulp"
    assert page.locator(".inspector code").inner_text() == "rayproof probe lights/broken 7 9"
    page.keyboard.press("Escape")
    hover(page, 9, 9)
    page.wait_for_url("**at=9%2C9**")


def test_a_hostile_name_is_text_everywhere(visit):
    page = visit.open(q="evil")

    page.locator(".cases tbody a").click()
    page.wait_for_selector(".pane .frame > canvas")

    assert legible(HOSTILE) in page.locator("h1").inner_text()
    assert page.locator("img[src=x]").count() == 0
    assert page.locator("body script").count() == 2
    hover(page, 3, 3)
    assert page.locator(".inspector code").inner_text().startswith("rayproof probe 'evil/<script>")
