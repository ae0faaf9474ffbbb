"""The report in a real browser, from disk: no error, no request, every float as in the EXR files."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest

from cases.stages import Stage, exr_channels
from reports.publish import publish_all
from reports.publish.exr import read_answers
from tests.reports.publish.sample import HOSTILE, make_folder, results_of

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed; on Debian: apt-get install chromium"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Return a headless Chromium."""
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM)
        yield chromium
        chromium.close()


class Visit:
    """A page of the report, and what went wrong in it."""

    def __init__(self, browser: Any, folder: Path, **context: Any) -> None:
        self.folder = folder
        self.context = browser.new_context(**context)
        self.page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.complaints.append("dialog"), dialog.dismiss()))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def open(self, **address: Any) -> Any:
        """Go to an address of the report and return the page."""
        self.page.goto(f"{(self.folder / 'index.html').as_uri()}#{urlencode(address)}")
        return self.page

    def names(self) -> list[str]:
        """Return the names of the cases in the list."""
        return self.page.locator(".cases tbody a").all_inner_texts()


@pytest.fixture
def visit(browser, published) -> Iterator[Visit]:
    """Return a visit to the sample report that must end without complaint and without leaving the folder."""
    one = Visit(browser, published.folder)
    yield one
    one.context.close()
    assert one.complaints == []
    assert all(url.startswith(published.folder.as_uri()) for url in one.requests if not url.startswith("data:"))


def test_the_first_screen_says_verdict_totals_and_coverage(visit):
    page = visit.open()

    assert page.locator("h1").inner_text().startswith("9 cases: 3 fail")
    assert page.locator(".ledger tbody tr").first.inner_text().split()[:3] == ["cases", "9", "="]
    assert page.locator(".coverage tbody tr").count() == 29
    assert "normal NRM-3" in page.locator(".blamed").inner_text()
    assert visit.names()[0] == "lights/broken"
    assert page.locator(".shout").count() == 0


def test_filters_narrow_the_list_and_live_in_the_address(visit):
    page = visit.open()

    page.get_by_label("verdict", exact=True).select_option("fail")
    assert sorted(visit.names()) == ["lights/acne", "lights/broken", "sphere/sheared"]
    page.get_by_label("id", exact=True).select_option("NRM-3")
    assert visit.names() == ["sphere/sheared"]
    page.reload()
    assert visit.names() == ["sphere/sheared"]
    page.get_by_role("button", name="clear").click()
    assert len(visit.names()) == 9
    page.get_by_label("search").press_sequentially("NRM-3 SHEAR")
    assert visit.names() == ["sphere/sheared"]
    page.get_by_label("search").fill("")
    page.get_by_role("button", name="LIT-5").click()
    assert visit.names() == ["lights/acne"]


def test_family_and_stage_filters(visit):
    visit.open(family="mesh")
    assert sorted(visit.names()) == ["mesh/crash", "mesh/empty", "mesh/huge"]
    visit.open(stage="camera", verdict="warn")
    assert visit.names() == ["plane/tilted"]


def test_a_case_opens_at_the_stage_that_is_blamed_and_goes_back(visit):
    page = visit.open(verdict="fail")

    page.locator(".cases").get_by_role("link", name="sphere/sheared").click()
    page.wait_for_selector("canvas")
    assert page.get_by_role("tab", selected=True).inner_text().endswith("normal")
    assert page.locator("figure canvas:not(.colorbar)").count() == 3
    assert "rayproof run sphere/sheared" in page.locator(".case-head .command").inner_text()
    page.keyboard.press("Escape")
    page.wait_for_selector(".cases")
    assert len(visit.names()) == 3


def test_every_stage_opens(visit):
    page = visit.open(case="sphere/plain", stage="camera")

    page.wait_for_selector(".tabs")
    for stage in Stage:
        page.locator(f"#tab-{stage}").click()
        page.wait_for_selector(f"#tab-{stage}[aria-selected=true]")
        assert page.locator(".checks tbody tr.current").count() == 1
        # Mitsuba is asked everything but the matrices of the camera.
        expected = 2 if stage is Stage.CAMERA else 4
        assert page.locator(".checks tbody tr:not(.derivation)").count() == expected


@pytest.mark.parametrize("reference", ["analytic", "mitsuba_scalar"])
def test_the_inspector_shows_the_floats_of_the_files_bit_for_bit(visit, published, reference):
    page = visit.open(case="lights/broken", stage="radiance", reference=reference)
    page.wait_for_selector("canvas")
    names = ("tracer-float32", reference)
    images = [read_answers(published.folder / f"images/lights/broken/{name}.exr") for name in names]
    canvas = page.locator("figure canvas").first
    box = canvas.bounding_box()

    # A corner, the NaN, the infinity, the middle, the last pixel.
    for column, row in ((0, 0), (3, 2), (5, 4), (20, 15), (39, 29)):
        canvas.hover(position={"x": (column + 0.5) * box["width"] / 40, "y": (row + 0.5) * box["height"] / 30})
        page.wait_for_selector(f".inspector h3:has-text('column {column}, row {row}')")
        page.wait_for_selector(".inspector td[data-stage=radiance]")
        cells = page.evaluate(
            "Array.from(document.querySelectorAll('.inspector td[data-stage]'),"
            " (cell) => [cell.dataset.stage, Number(cell.dataset.channel), cell.textContent])"
        )
        shown: dict[tuple[Any, ...], list[str]] = {}
        for stage, channel, text in cells:
            shown.setdefault((stage, channel), []).append(text)
        assert len(shown) == sum(len(exr_channels(stage, lights=2)) for stage in images[0])
        for (stage, channel), texts in shown.items():
            for text, image in zip(texts, images, strict=True):
                if stage in image:
                    expected, found = image[stage][row, column, channel], np.float32(text)
                    assert found.tobytes() == expected.tobytes() or (np.isnan(found) and np.isnan(expected))
                else:
                    assert text == ""


def test_special_values_have_colours_of_their_own(visit):
    page = visit.open(case="lights/broken", stage="radiance")
    page.wait_for_selector("canvas")

    def colour(figure: int, x: int, y: int) -> list[int]:
        return page.evaluate(
            "([figure, x, y]) => Array.from(document.querySelectorAll('figure .frame canvas')[figure]"
            ".getContext('2d').getImageData(x, y, 1, 1).data.slice(0, 3))",
            [figure, x, y],
        )

    assert colour(1, 3, 2) == colour(2, 3, 2) == [255, 0, 255]
    assert colour(1, 5, 4) == colour(2, 5, 4) == [0, 255, 255]


def test_the_difference_is_that_of_float64_numpy(visit, published):
    page = visit.open(case="sphere/sheared", stage="normal")
    page.wait_for_selector("canvas")
    ours, theirs = (
        read_answers(published.folder / f"images/sphere/sheared/{name}.exr")[Stage.NORMAL].astype(np.float64)
        for name in ("tracer-float32", "analytic")
    )
    difference = np.abs(ours - theirs).max(axis=-1)
    row, column = np.unravel_index(int(difference.argmax()), difference.shape)

    note = page.locator("figure:has-text('absolute difference') figcaption").inner_text()

    assert f"at {column}, {row} " in note
    assert f"{np.count_nonzero(difference)} of {difference.size} pixels differ" in note
    assert f"worst {difference.max():.3g} " in note.replace("e-0", "e-")


def test_exposure_channel_metric_reference_and_configuration_can_be_chosen(visit):
    page = visit.open(case="lights/broken", stage="radiance")
    page.wait_for_selector("canvas")

    def reference_image() -> str:
        return page.evaluate("document.querySelector('figure .frame canvas').toDataURL()")

    before = reference_image()
    page.get_by_label("exposure", exact=True).fill("3")
    brighter = reference_image()
    page.get_by_label("channel").select_option("G")
    assert len({before, brighter, reference_image()}) == 3
    page.get_by_label("difference", exact=True).select_option("ulp")
    page.wait_for_selector("figure:has-text('ulp difference')")
    page.get_by_label("ours", exact=True).select_option("tracer-float64")
    page.get_by_label("reference", exact=True).select_option("mitsuba_scalar")
    page.wait_for_selector(".checks tr.current:has-text('float64'):has-text('mitsuba_scalar')")
    assert "ours=tracer-float64" in page.url


def test_limits_show_their_derivation_and_closed_forms_and_unsupported_are_listed(visit):
    page = visit.open(case="sphere/sheared", stage="normal")
    page.wait_for_selector("canvas")

    page.get_by_role("button", name="limit & metrics").first.click()

    derivation = page.locator(".derivation:visible")
    assert "gamma(9) of float32" in derivation.inner_text()
    assert "relative mse" in derivation.inner_text()
    assert "E = I h / d^3" in page.get_by_role("region", name="Closed forms").inner_text()
    assert "has no such matrices" in page.get_by_role("region", name="Unsupported").inner_text()


def test_the_keyboard_moves_the_pixel_and_the_tabs(visit):
    page = visit.open(case="sphere/plain", stage="normal")
    page.wait_for_selector("canvas")

    page.locator("figure canvas").first.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        page.keyboard.press(key)
    page.wait_for_selector(".inspector h3:has-text('column 2, row 1')")
    page.get_by_role("tab", selected=True).focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#tab-visibility[aria-selected=true]:focus")


def test_a_hostile_name_is_text_everywhere(visit):
    page = visit.open()
    assert HOSTILE in visit.names()

    page.get_by_label("search").fill("evil")
    page.locator(".cases tbody a").click()
    page.wait_for_selector("canvas")

    assert HOSTILE in page.locator("h1").inner_text()
    assert page.locator("img[src=x]").count() == 0
    assert page.locator("body script").count() == 2
    page.locator("figure canvas").first.hover()
    page.wait_for_selector(".inspector code")
    assert page.locator(".inspector code").inner_text().startswith("rayproof probe 'evil/<script>")


def test_cases_without_images_say_so(visit):
    page = visit.open(case="mesh/crash")

    page.wait_for_selector(".case")

    assert "worker ended with signal 6" in page.locator(".case-head").inner_text()
    assert "Nothing was measured" in page.locator(".case").inner_text()


def test_an_unknown_case_is_said_in_a_line(visit):
    page = visit.open(case="no/such")

    assert page.locator(".shout").inner_text() == "There is no case called no/such."


def test_planted_faults_are_shouted_first_on_every_view(browser, tmp_path):
    results = make_folder(tmp_path)
    from reports.publish.results import save_results

    save_results(tmp_path, results_of(results["cases"], faults=("ray/flipped",)))
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)

    for address in ({}, {"case": "sphere/plain"}):
        page = visit.open(**address)
        page.wait_for_selector("main")
        assert page.locator("main > *").first.inner_text().startswith("PLANTED FAULTS IN USE: ray/flipped")
    visit.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_overflows_a_phone(browser, published, scheme):
    visit = Visit(browser, published.folder, viewport={"width": 390, "height": 844}, color_scheme=scheme)

    for address in ({}, {"case": "lights/broken", "stage": "radiance"}):
        page = visit.open(**address)
        page.wait_for_selector("main")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    visit.context.close()
