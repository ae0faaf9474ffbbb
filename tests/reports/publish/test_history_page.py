"""The page of a run's history, and the sentences of the front page, in a real browser; and what the folder holds."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.comparisons import DATA, history_front, history_of, publish
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import legible
from tests.reports.publish.sample import HOSTILE, make_folder
from tests.reports.publish.visits import Visit

SENTENCE = "sphere/plain: worst error / limit 0.9 at normal (float32 analytic), was 0.3 in run 3"


def series(*ratios: float | str | None, verdict: str = "pass", steps: tuple[Any, ...] = ()) -> dict[str, Any]:
    """Return a case's past: a run for each ratio, each a second long."""
    points = [[run, f"c0ffee{run}", verdict, ratio, 1.0] for run, ratio in enumerate(ratios, start=1)]
    return {"points": points, "error_steps": list(steps), "time_steps": []}


def history() -> dict[str, Any]:
    """Return the history of a fourth run."""
    return {
        "file": "past.sqlite",
        "run": 4,
        "worse": [{"case": "sphere/plain", "what": "error", "factor": 3.0, "sentence": SENTENCE}],
        "cases": {
            "plane/tilted": series(0.5, 0.5, 0.1, 0.1, steps=([3, 0.2],)),
            "sphere/plain": series(0.3, 0.3, 0.3, 0.9, steps=([4, 3.0],)),
            HOSTILE: series(0.0, None, "inf", 2.0, verdict="fail"),
        },
    }


def test_without_a_history_nothing_is_written_and_an_old_one_goes(tmp_path: Path) -> None:
    assert publish(tmp_path, {"history": history()}) == [tmp_path / DATA]

    assert publish(tmp_path, {}) == []
    assert not (tmp_path / DATA).exists()
    assert history_front({}) is None


def test_a_history_of_another_shape_is_none() -> None:
    for spoil in (
        lambda past: past["cases"]["sphere/plain"]["points"].append([1, 2]),
        lambda past: past.update(worse="all of it"),
        lambda past: past.update(cases=[]),
        lambda past: past["cases"].update({"a/b": None}),
        lambda past: past["cases"]["sphere/plain"].pop("time_steps"),
    ):
        past = copy.deepcopy(history())
        spoil(past)
        assert history_of({"history": past}) is None
    assert history_of({"history": history()}) == history()


@pytest.mark.browser
def test_what_became_worse_is_on_the_front_and_every_point_leads_to_its_case(browser: Any, tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    save_results(tmp_path, results | {"history": json.loads(json.dumps(history()))})
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)

    page = visit.open()
    front = page.get_by_role("region", name="Worse than its history")
    assert SENTENCE in front.inner_text()
    front.get_by_role("link", name="errors and times").click()
    page.wait_for_selector(".past .series")

    # What became worse comes first, then the latest step.
    assert page.locator(".past h3 bdi").all_inner_texts() == ["sphere/plain", "plane/tilted", legible(HOSTILE)]
    first, second, third = (page.locator(".past").nth(index) for index in range(3))
    assert first.locator(".step.up text").text_content().split()[-1] == "×3"
    assert second.locator(".step.down text").text_content().split()[-1] == "×0.2"
    assert first.locator(".series").first.locator(".dot").count() == 4
    assert first.locator(".dot title").nth(3).text_content() == "run 4 (c0ffee4): 0.9, pass"
    # Zero and infinity are drawn, what was not measured is not.
    third.scroll_into_view_if_needed()
    third.locator(".series").first.wait_for()
    assert third.locator(".series").first.locator(".dot.wrong").count() == 3

    first.locator(".dot").first.click()
    page.wait_for_selector(".case")
    assert page.locator("h1 bdi").inner_text() == "sphere/plain"
    page.wait_for_selector(".past .series")
    visit.end()
