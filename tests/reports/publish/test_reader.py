"""What a reader stumbled over: words, a phone, paper, the dark, which value decides, and whose pixels are wrong."""

import pytest

from rayproof.reports.publish.page.page import publish
from rayproof.reports.results.files import legible
from tests.reports.publish.sample import HOSTILE, make_folder
from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser
GATE = {
    "file": "known.json", "sentence": "", "red": True, "regressions": ["sphere/sheared: float32: no entry is about it"],
    "tighten": ["plane/tilted: float32 analytic ray passes now"], "stale": [], "expired": [],
    "matched": ["lights/acne: 4 failing checks: it is known"], "cases": ["lights/acne", "lights/broken"],
}  # fmt: skip


def test_new_accepted_and_mended_failures_are_apart_each_with_its_count(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path) | {"gate": GATE})
    visit = Visit(browser, tmp_path)

    page = visit.open()

    titles = page.locator(".blamed h3").all_inner_texts()
    assert titles == ["New: 4 cases", "Accepted: 2 cases", "Mended: 1"]
    assert "1 case: normal NRM-3 (world normal by the inverse transpose)" in page.locator(".blamed").inner_text()
    assert page.locator("h1").inner_text().count(". ") == 0
    visit.end()


def test_what_decides_comes_first_and_every_other_value_is_named_for_what_it_is(visit):
    page = visit.open(case="sphere/sheared", stage="normal")
    page.wait_for_selector(".histogram")

    decides = page.locator(".decides").inner_text()
    assert decides.startswith(
        "What decides: 12 of 4,000 pixels are wrong, those of float32. The worst pixel is 18, 14: off"
    )
    assert page.locator(".decides").bounding_box()["y"] < page.locator(".panes").bounding_box()["y"]
    heads = page.locator(".checks thead th").all_inner_texts()
    assert [head.split("\n")[0] for head in heads[3:]] == [
        "error / limit, end to end", "error / limit, continued", "worst pixel", "its error and limit",
        "what became of the pixels",
    ]  # fmt: skip
    assert "largest error of a channel" in page.locator("figure:has-text('absolute error') figcaption").inner_text()
    assert (
        "the limit of the deciding pixel; each pixel has a limit of its own" in page.locator(".histogram").inner_text()
    )


def test_whose_pixels_are_wrong_is_said(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path))
    visit = Visit(browser, tmp_path)

    page = visit.open(case=legible(HOSTILE))

    said = page.locator(".reason").all_inner_texts()
    assert any("Wrong are the pixels of analytic, not those of float32" in text for text in said)
    assert "12 wrong (analytic)" in page.locator(".checks").inner_text()
    assert "those of analytic" in page.locator(".decides").inner_text()
    visit.end()
