"""What a reader stumbled over: words, a phone, paper, the dark, which value decides, and whose pixels are wrong."""

import json
from io import BytesIO

import pytest
from matplotlib.image import imread
from msgspec.structs import replace

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.page import publish
from rayproof.reports.publish.page.thumbnails import picture
from rayproof.reports.results.files import legible
from tests.reports.publish.page.test_plots import DIAGRAMS, POINT
from tests.reports.publish.sample import HOSTILE, make_folder, results_of
from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser
PHONE = {"width": 390, "height": 844}
GATE = {
    "file": "known.json", "sentence": "", "red": True, "regressions": ["sphere/sheared: float32: no entry is about it"],
    "tighten": ["plane/tilted: float32 analytic ray passes now"], "stale": [], "expired": [],
    "matched": ["lights/acne: 4 failing checks: it is known"], "cases": ["lights/acne", "lights/broken"],
}  # fmt: skip
# How many rows there are, and whether each holds its cells and begins below the one before.
OVERLAPS = """() => {
    const rows = [...document.querySelectorAll(".cases tbody tr:not(.spacer)")];
    const end = (node) => node.getBoundingClientRect().bottom;
    const inside = rows.every((row) =>
        [...row.children].every((cell) => !cell.getClientRects().length || end(cell) <= end(row) + 1));
    const apart = rows.every((row, i) => !i || row.getBoundingClientRect().top >= end(rows[i - 1]) - 1);
    return [rows.length, inside && apart];
}"""
NO_LABEL = """() => [...document.querySelectorAll(".checks tbody tr:not(.derivation) td")].filter((cell) =>
    cell.textContent && !cell.querySelector("button.quiet")
    && !getComputedStyle(cell, "::before").content.includes(":")).length"""


def test_new_accepted_and_mended_failures_are_apart_each_with_its_count(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path) | {"gate": GATE})
    visit = Visit(browser, tmp_path)

    page = visit.open()

    titles = page.locator(".blamed h3").all_inner_texts()
    assert titles == ["New: 4 cases", "Accepted: 2 cases", "Mended: 1"]
    assert "1 case: normal NRM-3 (world normal by the inverse transpose)" in page.locator(".blamed").inner_text()
    assert page.locator("h1").inner_text().count(". ") == 0
    visit.end()


def test_no_number_of_limits_is_infinite_or_huge(visit):
    for address in ({}, {"case": "lights/broken", "stage": "radiance"}, {"case": "sphere/sheared", "stage": "normal"}):
        page = visit.open(**address)
        bars = page.locator(".ratio").all_inner_texts()
        assert "over 1000" in bars
        assert not any("inf" in bar or "e+" in bar for bar in bars)


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


def test_words_link_to_their_definitions_and_signs_have_a_legend(visit):
    page = visit.open(case="sphere/sheared", stage="normal")

    page.locator(".decides a.term", has_text="worst pixel").click()

    page.wait_for_selector("dt.current")
    assert page.locator("dt.current").inner_text() == "worst pixel"
    box = page.locator("dt.current").bounding_box()
    assert 0 <= box["y"] < page.viewport_size["height"]
    legend = page.get_by_role("region", name="Legend").inner_text()
    assert all(words in legend for words in ("reference suspect", "explained by rounding", "not examined", "NaN"))
    assert page.locator(".terms dt").count() > 40


def test_a_reference_that_is_called_as_a_stage_has_a_name_of_its_own(browser, tmp_path):
    results = make_folder(tmp_path)
    for case in results["cases"]:
        case["checks"] = [
            replace(check, reference="radiance") if check.reference == "mitsuba_scalar" else check
            for check in case["checks"]
        ]
    results["references"]["radiance"] = results["references"].pop("mitsuba_scalar")
    publish(tmp_path, results)
    visit = Visit(browser, tmp_path)

    page = visit.open()
    assert "Radiance (rtrace)" in page.locator(".cases thead th").all_inner_texts()
    page = visit.open(case="sphere/sheared", stage="radiance")
    assert page.locator(".checks tbody td", has_text="Radiance (rtrace)").count() == 2
    visit.end()


def test_whose_pixels_are_wrong_is_said(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path))
    visit = Visit(browser, tmp_path)

    page = visit.open(case=legible(HOSTILE))

    said = page.locator(".reason").all_inner_texts()
    assert any("Wrong are the pixels of analytic, not those of float32" in text for text in said)
    assert "12 wrong (analytic)" in page.locator(".checks").inner_text()
    assert "those of analytic" in page.locator(".decides").inner_text()
    visit.end()


def test_on_a_phone_rows_do_not_overlap_and_the_list_is_near_and_a_case_is_short(browser, tmp_path):
    make_folder(tmp_path, extra_cases=30)
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path, viewport=PHONE)

    page = visit.open()
    rows, apart = page.evaluate(OVERLAPS)
    assert rows >= 20
    assert apart
    assert page.evaluate("document.getElementById('cases').getBoundingClientRect().top + scrollY") < 4500
    page = visit.open(case="sphere/sheared", stage="normal")
    page.wait_for_selector(".inspector tbody tr")
    assert page.evaluate("document.documentElement.scrollHeight") < 7000
    assert page.evaluate(NO_LABEL) == 0, "each value of a stacked table has its column's name"
    visit.end()


def test_paper_gets_the_wide_layout_in_light_colours_and_all_cases(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path, extra_cases=120))
    visit = Visit(browser, tmp_path, color_scheme="dark", viewport={"width": 720, "height": 1000})
    page = visit.open()

    page.emulate_media(media="print", color_scheme="dark")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")

    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.evaluate("getComputedStyle(document.querySelector('.cases thead')).display") == "table-header-group"
    assert page.evaluate("getComputedStyle(document.querySelector('.coverage tbody')).display") == "table-row-group"
    assert not page.locator("nav.pages").is_visible()
    assert page.locator(".cases tbody tr:not(.spacer)").count() == 129
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator(".cases tbody tr:not(.spacer)").count() < 129
    visit.end()


def test_the_gutters_between_small_pictures_are_those_of_the_page(tmp_path):
    results = make_folder(tmp_path)
    case = next(case for case in results["cases"] if case["name"] == "sphere/sheared")

    drawn = picture(tmp_path, case)

    assert drawn is not None
    pixels = imread(BytesIO(drawn), format="png")
    assert pixels.shape[2] == 4
    clear = (pixels[..., 3] == 0).all(axis=0)
    assert clear.sum() == 8, "two gaps of four pixels"
    assert (pixels[:, ~clear, 3] == 1).all()


def test_a_run_without_failures_says_nothing_of_what_is_wrong(browser, tmp_path):
    results = make_folder(tmp_path)
    publish(tmp_path, results_of([case for case in results["cases"] if case["verdict"] == "pass"]))
    visit = Visit(browser, tmp_path)

    assert visit.open().locator(".blamed").count() == 0
    visit.end()


def test_a_formula_that_decides_all_pixels_wrongly_is_drawn_at_the_edge(browser, tmp_path):
    make_folder(tmp_path)
    lost = POINT | {"variant": "astray", "label": "astray, float32", "error": "nan", "wrong": 1.0, "front": False}
    for name in ("error_low", "error_high"):
        lost[name] = "nan"
    (diagram,) = DIAGRAMS["diagrams"]
    (tmp_path / "tradeoff").mkdir()
    content = DIAGRAMS | {"diagrams": [diagram | {"points": [POINT, lost]}]}
    (tmp_path / "tradeoff" / "tradeoff.json").write_text(json.dumps(content))
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)

    page = visit.open(page="tradeoff")

    page.wait_for_selector(".plot[data-drawn]")
    assert "astray (all wrong)" in page.locator(".plot .legend").first.text_content()
    page.get_by_text("numbers", exact=True).first.click()
    assert "all wrong" in page.get_by_role("group", name="table of points").inner_text()
    visit.end()
