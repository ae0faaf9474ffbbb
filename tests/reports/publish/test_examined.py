"""What was examined, who had no say and what a whole run shares stand where the verdict stands."""

from typing import Any

import pytest
from msgspec import convert
from msgspec.structs import replace

from rayproof.reports.publish.page.page import publish
from rayproof.reports.results.case_records import Bias, Examined
from rayproof.reports.results.headline import examined_line, headline, no_say, remarks
from rayproof.reports.results.outcomes import Outcome
from tests.reports.publish.sample import make_folder
from tests.reports.publish.visits import Visit

LEDGER = {
    "pixels": 4_321_007, "strict": 4_300_000, "wide": 1000, "rounding": 20_000, "epsilon": 6, "wrong": 1,
    "unexamined": 0,
}  # fmt: skip
FACTOR = "radiance of float32 is 1.00002949 times what it should be in the whole run"
GROUPS = [
    {"shape": 2, "lights": [0], "pixels": 812, "off": [1e-7, 2e-7, None], "sees": [3e-7, 3e-7, None]},
    {"shape": 0, "lights": [0, 1], "fitted": 1, "pixels": 90, "off": [2.9e-5, 0.0, 0.0], "sees": [1e-6, 1e-6, 1e-6]},
]
FACTORS = {"common": None, "allowance": 1e-7, "sees": 3e-7}
BIAS = convert(FACTORS | {"ratio": 29.0, "groups": GROUPS, "continued": FACTORS | {"ratio": 0.1}}, Bias)
POOLED = {"configuration": "float32", "stage": "radiance", "cases": 90, "voices": 60, "off": 2.9e-5, "sees": 6e-7}


def told(results: dict[str, Any]) -> dict[str, Any]:
    """Return results with a ledger, a reference lost on the way, and a factor that the whole run shares."""
    for case in results["cases"]:
        for place, check in enumerate(case["checks"]):
            lit = check.stage == "radiance" and check.reference == "analytic"
            examined = convert({"pixels": 1200, "rounding": 31}, Examined)
            case["checks"][place] = replace(check, examined=examined, bias=BIAS if lit else None)
    why = "it did not end within 120 s and was stopped"
    return results | {
        "examined": LEDGER,
        "abstained": {"radiance": {"lights/acne": why, "mesh/huge": why}},
        "common_factors": [POOLED | {"verdict": "fail"}],
        "wrong_factors": [FACTOR],
    }


def test_the_ledger_is_one_line_with_every_kind_that_there_is_and_always_what_was_not_examined():
    assert examined_line({"examined": LEDGER}) == (
        "4,321,007 pixels over all checks: 4,300,000 strictly, 1,000 by a limit over 1 % of the value, 20,000 "
        "explained by rounding, 6 explained only by a declared epsilon, 1 wrong, 0 not examined."
    )
    for unread in ({}, {"examined": None}, {"examined": {"pixels": 3}}, {"examined": dict.fromkeys(LEDGER, 0)}):
        assert examined_line(unread) is None


def test_a_run_that_lost_a_reference_on_the_way_does_not_say_that_all_was_checked():
    counts = {"planned": 147, **dict.fromkeys((outcome.value for outcome in Outcome), 0)}
    lost = {"radiance": {"mesh/huge": "a crash"}}
    run = {
        "summary": counts | {"planned": 9, "pass": 9},
        "checks": counts | {"pass": 144, "undecided": 3},
        "cases": [],
    }

    assert headline(run | {"abstained": lost}) == "9 cases: all pass, in 144 of 147 checks (3 undecided)."
    silent = "Radiance (rtrace) had no say in mesh/huge, where it was asked: a crash"
    assert remarks(run | {"abstained": lost}) == [f"{silent}."]
    assert no_say({"abstained": lost}) == [silent]
    assert no_say({"abstained": "nobody"}) == no_say({}) == []
    late = {
        "abstained": {"radiance": {"mesh/huge": "a crash", "a/b": "no answer within 120 s"}},
        "stopped": {"radiance": ["a/b"]},
    }
    assert no_say(late) == [
        "a time limit stopped Radiance (rtrace) in a/b",
        silent,
    ]
    assert remarks(run | late) == ["A time limit stopped Radiance (rtrace) in a/b.", f"{silent}."]


@pytest.mark.browser
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_shows_them_on_its_first_screen_and_each_checks_on_its_case(browser, tmp_path, width):
    publish(tmp_path, told(make_folder(tmp_path)))
    visit = Visit(browser, tmp_path, viewport={"width": width, "height": 900})
    page = visit.open()

    assert FACTOR in page.locator("h1").inner_text()
    assert page.locator(".remarks").bounding_box()["y"] < 900
    assert "4,300,000 strictly" in page.locator(".kinds").inner_text()
    assert "0 not examined" in page.locator(".kinds").inner_text()
    assert "(rtrace) had no say in lights/acne and 1 more" in page.locator(".remarks").inner_text()
    assert page.locator("details", has_text="Factors that the whole run shares (1 wrong)").get_attribute("open") == ""
    assert page.evaluate("document.documentElement.scrollWidth") <= width

    page = visit.open(case="sphere/plain", stage="radiance")
    page.wait_for_selector(".checks tbody")
    row = page.locator(".checks tbody tr").first
    assert "1169 strictly, 31 explained by rounding" in row.inner_text()
    row.get_by_role("button", name="details").click()
    shared = page.locator(".derivation:not([hidden]) table").inner_text()
    assert shared.splitlines()[1].split()[:4] == ["0", "1", "of", "0,"], "what is farthest over its limit comes first"
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert visit.complaints == []
    visit.context.close()
