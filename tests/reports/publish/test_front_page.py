"""The front page in a real browser, from disk: verdict, totals, coverage, and the matrix of cases."""

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page import front
from rayproof.reports.publish.page import page as page_module
from rayproof.reports.publish.page.page import publish
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import legible
from tests.reports.publish.sample import HOSTILE, make_folder, results_of
from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser


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


def test_columns_sort_and_the_order_lives_in_the_address(visit):
    page = visit.open()

    page.get_by_title("sort by case", exact=True).click()
    assert visit.names() == sorted(visit.names())
    assert "sort=name" in page.url
    assert page.locator("th[aria-sort=ascending]").inner_text().startswith("case")
    page.get_by_title("sort by case", exact=True).click()
    assert visit.names() == sorted(visit.names(), reverse=True)
    page.get_by_title("sort by error / limit", exact=True).click()
    assert visit.names()[0] == "lights/broken"
    page.reload()
    assert page.locator("th[aria-sort=descending]").inner_text().startswith("error / limit")


def test_a_thousand_cases_are_a_window_of_rows(browser, tmp_path):
    results = make_folder(tmp_path)
    template = next(case for case in results["cases"] if case["name"] == "mesh/empty")
    many = [template | {"name": f"many/case_{i:04}", "family": "many", "verdict": "pass"} for i in range(1000)]
    publish(tmp_path, results_of(results["cases"] + many))
    visit = Visit(browser, tmp_path)
    page = visit.open()

    assert page.locator(".cases").get_attribute("aria-rowcount") == "1010"
    assert page.locator(".cases tbody tr").count() < 100
    page.locator(".cases tbody a").first.focus()
    for _ in range(30):
        page.keyboard.press("j")
    assert page.evaluate("document.activeElement.textContent") == "many/case_0021"
    page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
    page.wait_for_selector("text=many/case_0999")
    page.get_by_label("search").fill("case_0777")
    assert visit.names() == ["many/case_0777"]
    visit.end()


def test_planted_faults_are_shouted_first_on_every_view(browser, tmp_path):
    results = make_folder(tmp_path)
    save_results(tmp_path, results_of(results["cases"], faults=("ray/flipped",)))
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)

    for address in ({}, {"case": "sphere/plain"}):
        page = visit.open(**address)
        assert page.locator("main > *").first.inner_text().startswith("PLANTED FAULTS IN USE: ray/flipped")
    visit.end()


def test_a_hostile_name_is_text_in_the_list(visit):
    visit.open(q="evil")

    assert visit.names() == [legible(HOSTILE)]


def test_one_row_a_cause_with_its_cases_and_the_rest_by_what_may_be_to_blame(browser, tmp_path):
    results = make_folder(tmp_path)
    explained = ["sphere/sheared", "lights/broken"]
    cause = {"mistake": "no_pi", "items": ["RAD-4"], "sentence": "The renderer leaves out 1/pi.", "cases": explained}
    for case in results["cases"]:
        if case["name"] == "lights/acne":
            case |= {"item": None, "blamed_items": ["LIT-3", "LIT-5"], "excluded": {"LIT-1": "mesh/empty: visibility"}}
    publish(tmp_path, results_of(results["cases"]) | {"diagnosis": [cause]})
    visit = Visit(browser, tmp_path)

    page = visit.open()

    rows = page.locator(".blamed li").all_inner_texts()
    (row,) = [row for row in rows if "2 cases: The renderer leaves out 1/pi" in row]
    assert all(name in row for name in explained)
    assert any("LIT-3 (against acne: a minimum t) or LIT-5 (" in row and "lights/acne" in row for row in rows)
    page = visit.open(case="lights/acne")
    assert "LIT-1 (by mesh/empty: visibility)" in page.locator("main").inner_text()
    visit.end()


def test_a_long_list_is_columns_in_the_page_and_rows_in_scripts(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(front, "SHARD", 32)
    monkeypatch.setattr(page_module, "SHARD", 32)
    results = make_folder(tmp_path, extra_cases=120)
    publish(tmp_path, results)
    assert sorted(path.name for path in (tmp_path / "data").iterdir()) == ["000", "001", "002", "003", "004"]
    assert "A unit sphere over a plane" not in (tmp_path / "index.html").read_text()
    visit = Visit(browser, tmp_path)

    page = visit.open()
    first = page.locator(".cases tbody tr").nth(1)
    first.get_by_text("interior pixels beyond the limit").wait_for()
    assert first.locator(".cell.v-fail").count() >= 1
    assert "interior pixels beyond the limit" in page.locator(".blamed li").first.inner_text()
    page.get_by_label("id", exact=True).select_option("NRM-3")
    assert visit.names() == ["sphere/sheared"]
    page.get_by_role("button", name="clear").click()
    page.get_by_title("sort by case", exact=True).click()
    page.get_by_title("sort by case", exact=True).click()
    assert visit.names()[0] == "sphere/sheared"
    page = visit.open(case="more/case_119")
    assert "A unit sphere over a plane" in page.locator("main").inner_text()
    page.locator(".pane canvas").first.wait_for()
    visit.end()
