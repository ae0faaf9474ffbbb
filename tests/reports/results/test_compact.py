"""What repeats or goes without saying is left out of results.json, and put back where it belongs."""

import copy
import json

from rayproof.reports.results.compact import COUNTS, TABLE, compact, expand
from rayproof.reports.results.document import load_results, save_results

MEASURED = {"worst_ratio": 0.5, "worst_inside": 0.5, "ours": [0, 1]} | dict.fromkeys(COUNTS, 0) | {"edge": 3}


def compacted(results):
    places = {}
    cases = [compact(case, places) for case in results["cases"]]
    return {TABLE: list(places), "cases": cases}


def test_every_text_is_in_the_file_once_and_in_every_check_when_read(tmp_path, published):
    save_results(tmp_path, published.results)

    text = (tmp_path / "results.json").read_text()
    because = published.results["cases"][0]["checks"][0]["because"]
    assert text.count(because) == 1
    assert json.loads(text)["cases"][0]["checks"][0]["because"] == 0
    assert load_results(tmp_path)["cases"][0]["checks"][0]["because"] == because


def test_texts_are_told_by_their_place_and_come_back():
    full = {"reason": "", "end_to_end": None, "continued": None}
    checks = [{"because": text, **full} for text in "aba"]
    results = {"cases": [{"checks": [*checks, full]}, {}]}
    before = copy.deepcopy(results)

    once = compacted(results)

    assert once["derivations"] == ["a", "b"]
    assert [check.get("because") for check in once["cases"][0]["checks"]] == [0, 1, 0, None]
    assert results == before
    expand(once)
    assert once == results
    expand(once)
    assert once == results


def test_what_goes_without_saying_is_left_out_and_put_back():
    check = {"reason": "", "end_to_end": MEASURED, "continued": None, "ratio": 0.5}
    results = {"cases": [{"checks": [check]}]}

    once = compacted(results)

    assert once["cases"][0]["checks"] == [{"end_to_end": {"worst_ratio": 0.5, "ours": [0, 1], "edge": 3}, "ratio": 0.5}]
    expand(once)
    assert once == results


def test_what_says_something_stays():
    check = {
        "reason": "it is off",
        "end_to_end": MEASURED | {"worst_inside": 0.25, "nan": 1},
        "continued": MEASURED | {"worst_ratio": "inf", "worst_inside": "nan"},
    }

    (left,) = compacted({"cases": [{"checks": [check]}]})["cases"][0]["checks"]

    assert left["reason"] == "it is off"
    assert left["end_to_end"] == {"worst_ratio": 0.5, "worst_inside": 0.25, "ours": [0, 1], "edge": 3, "nan": 1}
    assert (left["continued"]["worst_ratio"], left["continued"]["worst_inside"]) == ("inf", "nan")


def test_results_that_leave_nothing_out_can_still_be_read(tmp_path, published):
    written = json.dumps(published.results | {"schema": 1})

    (tmp_path / "results.json").write_text(written.replace("Infinity", '"inf"'))

    save_results(tmp_path / "new", published.results)
    assert load_results(tmp_path)["cases"] == load_results(tmp_path / "new")["cases"]


def test_a_place_beyond_the_table_says_nothing_rather_than_fail():
    damaged = {"derivations": ["a"], "cases": [{"checks": [{"because": 7}, {"because": -1}]}]}

    expand(damaged)

    assert [check["because"] for check in damaged["cases"][0]["checks"]] == ["", ""]
