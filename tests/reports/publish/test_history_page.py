"""The page of a run's history, and the sentences of the front page, in a real browser; and what the folder holds."""

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.history.database import keep
from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.comparisons import DATA, history_front, publish
from rayproof.reports.results.document import ResultsError, load_results, save_results
from rayproof.reports.results.files import legible
from tests.reports.publish.sample import HOSTILE, make_folder
from tests.reports.publish.visits import Visit

SENTENCE = "sphere/plain: worst error / limit 0.9 at normal (float32 analytic), at most 0.3 in the runs before"


def series(*ratios: float | str | None, verdict: str = "pass") -> list[list[Any]]:
    """Return a case's past: a run for each ratio, each a second long."""
    return [[run, f"c0ffee{run}", verdict, ratio, 1.0] for run, ratio in enumerate(ratios, start=1)]


def history() -> dict[str, Any]:
    """Return the history of a fourth run."""
    return {
        "file": "past.sqlite",
        "run": 4,
        "worse": [{"case": "sphere/plain", "what": "error", "factor": 3.0, "sentence": SENTENCE}],
        "cases": {
            "plane/tilted": series(0.5, 0.5, 0.1, 0.1),
            "sphere/plain": series(0.3, 0.3, 0.3, 0.9),
            HOSTILE: series("inf", None, 2.0, 0.0, verdict="fail"),
        },
    }


def test_without_a_history_nothing_is_written_and_an_old_one_goes(tmp_path: Path) -> None:
    assert publish(tmp_path, {"history": history()}) == [tmp_path / DATA]

    assert publish(tmp_path, {}) == []
    assert not (tmp_path / DATA).exists()
    assert history_front({}) is None


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda past: past["cases"]["sphere/plain"].append([1, 2]), "must be a list of another length"),
        (lambda past: past.update(worse="all of it"), "history.worse must be a list, got 'all of it'"),
        (lambda past: past.update(cases=[]), "history.cases must be an object"),
        (lambda past: past["cases"].update({"a/b": None}), "must be a list"),
        (lambda past: past.pop("run"), "history.run is missing"),
    ],
)
def test_a_history_of_another_shape_is_refused_when_it_is_read(spoil: Any, said: str, tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    past = copy.deepcopy(history())
    save_results(tmp_path, results | {"history": copy.deepcopy(past)})
    written = json.loads((tmp_path / "results.json").read_text())
    spoil(written["history"])
    (tmp_path / "results.json").write_text(json.dumps(written))

    with pytest.raises(ResultsError, match=said):
        load_results(tmp_path)


def test_a_run_that_was_just_kept_has_its_history_on_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GITHUB_SHA", "c0ffee")  # git is not asked
    results = make_folder(tmp_path)

    keep(tmp_path / "past.sqlite", results)
    publish_all(tmp_path, results)  # as a run hands it over, and not as it is read from a file

    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    (data,) = re.findall('id="results">(.*)</script>', page)
    assert json.loads(data)["history"]["run"] == 1
    assert (tmp_path / DATA).is_file()


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

    # What became worse comes first, then the largest error of the last run.
    assert page.locator(".past h3 bdi").all_inner_texts() == ["sphere/plain", "plane/tilted", legible(HOSTILE)]
    first, third = page.locator(".past").first, page.locator(".past").nth(2)
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
