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


def test_only_what_is_blamed_is_red_in_the_coverage(visit):
    page = visit.open()

    row = page.locator(".coverage tbody tr")
    assert [row.nth(i).locator("th").inner_text() for i in range(29) if row.nth(i).locator(".v-fail").count()] == [
        "NRM-3",
        "LIT-5",
        "RAD-4",
    ]


def test_a_run_that_passes_shows_a_contact_sheet_first_and_a_key_changes_its_stage(browser, tmp_path):
    results = make_folder(tmp_path, extra_cases=3)
    publish(tmp_path, results_of([case for case in results["cases"] if case["verdict"] in ("pass", "warn")]))
    visit = Visit(browser, tmp_path, viewport={"width": 1280, "height": 720})
    page = visit.open()
    pictures = """() => Array.from(document.querySelectorAll('.sheet canvas'), (canvas) => canvas.toDataURL())"""

    page.wait_for_selector(".sheet[data-painted=radiance]")
    assert page.locator(".sheet a").first.inner_text().split()[-1] == "plane/tilted"
    assert page.locator(".sheet a").count() == 5
    box = page.locator(".sheet").bounding_box()
    assert box["y"] + box["height"] < 720
    radiance = page.evaluate(pictures)
    page.keyboard.press("[")
    page.keyboard.press("[")
    page.wait_for_selector(".sheet[data-painted=irradiance]")
    assert all(a != b for a, b in zip(radiance, page.evaluate(pictures), strict=True))
    page.locator(".sheet a").first.click()
    page.wait_for_selector("#tab-irradiance[aria-selected=true]")
    visit.end()


def test_what_differs_is_seen_at_once_the_worst_first_and_by_what_is_wrong(browser, tmp_path):
    make_folder(tmp_path)
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)  # of its own: another test publishes the shared one again, without small pictures
    page = visit.open()

    first, *others = page.locator(".differences img").all()
    assert page.locator(".differences figcaption").inner_text().startswith("The worst: ")
    assert first.get_attribute("alt").split(":")[0] == page.locator(".differences figcaption a").inner_text()
    page.wait_for_function(
        "[...document.querySelectorAll('.differences img')].every(i => i.complete && i.naturalWidth > 100)"
    )
    assert len(others) == page.locator(".thumbnails a").count() >= 2
    headings = page.locator(".differences h3").all_inner_texts()
    assert len(headings) == len(set(headings)) >= 2
    page.locator(".thumbnails a").first.click()
    page.wait_for_selector("main.case")
    visit.end()


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


def test_the_matrix_has_a_column_per_reference_or_per_configuration(visit):
    page = visit.open()
    assert page.locator(".cases thead th.matrix").all_inner_texts() == ["analytic", "mitsuba_scalar"]
    row = page.locator(".cases tbody tr", has_text="sphere/sheared")
    assert "fail" in row.locator("td.matrix").first.inner_text()

    page.get_by_label("columns").select_option("ours")

    assert page.locator(".cases thead th.matrix").all_inner_texts() == ["float32", "float64"]
    page.get_by_title("sort by float32", exact=True).click()
    assert visit.names()[0] == "lights/broken"


def test_totals_stand_once_on_the_first_screen(browser, published):
    visit = Visit(browser, published.folder, viewport={"width": 1280, "height": 900})
    page = visit.open()

    screen = page.evaluate("""() => [...document.querySelectorAll("main *")].filter((node) => !node.children.length
        && node.getBoundingClientRect().top < innerHeight).map((node) => node.textContent).join("\\n")""")

    assert screen.count("9 cases") == 1
    assert "planned" not in screen
    assert page.get_by_role("region", name="Totals").count() == 1
    visit.end()


def test_the_keyboard_searches_walks_and_opens(visit):
    page = visit.open()

    page.keyboard.press("/")
    page.keyboard.type("sphere")
    page.keyboard.press("Escape")
    assert len(visit.names()) == 9
    page.locator("h1").click()
    page.keyboard.press("j")
    page.keyboard.press("j")
    assert page.evaluate("document.activeElement.textContent") == visit.names()[1]
    page.keyboard.press("Enter")
    page.wait_for_selector(".case")


def test_what_was_slow_names_cases_and_renderers(visit):
    page = visit.open()

    page.get_by_text("What was slow").click()

    slow = page.locator("details[open]", has_text="What was slow").inner_text()
    assert "sphere/plain" in slow
    assert "tracer-float64" in slow


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


def test_what_failed_is_in_sight_on_a_telephone(browser, tmp_path):
    publish(tmp_path, make_folder(tmp_path))
    visit = Visit(browser, tmp_path, viewport={"width": 390, "height": 844})

    page = visit.open()

    for cell in page.locator(".ledger tbody td:visible").all():
        box = cell.bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= 390
    assert page.locator('.ledger td[data-word="fail"]:visible').count() == 2


@pytest.mark.parametrize("name", ["stability", "tradeoff"])
def test_the_tabs_of_studies_are_there_and_name_the_commands_that_fill_them(visit, name):
    page = visit.open()
    tabs = ["Cases", "Stability", "Error against time", "References", "Terms"]
    assert page.locator("nav.pages a").all_inner_texts() == tabs

    page = visit.open(page=name)

    command = f"rayproof {name} --quick --out FOLDER && rayproof report FOLDER"
    assert page.locator(".command code").all_inner_texts() == [command]


def test_a_run_shows_its_own_errors_against_times(browser, tmp_path):
    results = make_folder(tmp_path)
    case = next(case for case in results["cases"] if case["name"] == "sphere/plain")
    case["renders"][0] |= {"configuration": "float32", "kernels": 0.0002, "launches": 3}
    case["renders"][1] |= {"configuration": "float64", "cached": True}
    case["renders"][2] |= {"cached": True}
    publish_all(tmp_path, results)
    visit = Visit(browser, tmp_path)
    page = visit.open(page="tradeoff")

    page.wait_for_selector(".plot[data-drawn]")
    own = page.get_by_role("region", name="Error against time of this run")
    assert own.locator(".plot .points path").count() == 1  # by the reference against which it does worst
    rows = [row.split() for row in own.locator("tbody tr").all_inner_texts()]
    cache, scalar = ["from", "the", "cache"], ["120"]
    assert sorted(row[2:3] + row[4:] for row in rows) == [
        ["analytic", "0.21", "0.2", "3", *cache], ["mitsuba_scalar", "0.21", "0.2", "3", *scalar],
    ]  # fmt: skip
    page.get_by_label("reference", exact=True).select_option("analytic")
    assert own.locator("tbody tr").count() == 1
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
