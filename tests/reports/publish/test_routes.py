"""The front page tells what the tracer's other routes were compared in, and opens where one differs."""

from typing import Any

import pytest

from rayproof.reports.publish.page.page import publish
from rayproof.reports.publish.page.routes_data import Routes
from tests.reports.publish.sample import make_folder
from tests.reports.publish.visits import Visit


def compared(path: str, worst: float | str, verdict: str = "pass") -> dict[str, Any]:
    about = {"path": path, "configuration": "float32", "with": "the stages", "how": "to the last bit"}
    return {**about, "pixels": 1200, "worst": worst, "verdict": verdict, "stage": None, "differ": 0, "pixel": None}


def test_comparisons_of_a_route_are_added_up_and_the_worst_named() -> None:
    cases = [
        {"name": "a", "consistency": [compared("numbers", 0.0), compared("frames", 0.2)]},
        {"name": "b", "consistency": [compared("numbers", "inf", "fail"), compared("frames", 0.4)]},
        {"name": "c"},
    ]

    routes = Routes()
    for case in cases:
        routes.add(case)

    differs, agrees = routes.rows

    assert (differs["path"], differs["cases"], differs["pixels"], differs["failed"]) == ("numbers", 2, 2400, ["b"])
    assert differs["worst"] == float("inf")
    assert (agrees["path"], agrees["worst"], agrees["where"], agrees["failed"]) == ("frames", 0.4, "b", [])


@pytest.mark.browser
@pytest.mark.parametrize("fails", [False, True], ids=["agrees", "differs"])
def test_the_page_lists_routes_and_paths_and_opens_where_one_differs(browser: Any, tmp_path: Any, fails: bool) -> None:
    results = make_folder(tmp_path)
    case = next(one for one in results["cases"] if one["name"] == "plane/tilted")
    case["consistency"] = [compared("frames of tiles", 4.0 if fails else 0.3, "fail" if fails else "pass")]
    results["paths"] = {"plan/4 x 1": {"executed": 7, "compared": 3}}
    publish(tmp_path, results)
    page = Visit(browser, tmp_path).open()

    panel = page.locator("details", has_text="Paths of the tracer")
    assert (panel.get_attribute("open") is not None) == fails
    assert f"1 taken; 1 comparisons, {'1 differ' if fails else 'none differs'}" in panel.locator("summary").inner_text()
    text = panel.text_content()
    assert "frames of tiles" in text
    assert "plan/4 x 1" in text
    assert "1,200" in text
    assert "tilted" in text
