"""What derives a limit is written once and read back where it belongs."""

import json

from reports.publish.derivations import folded, unfold
from reports.publish.results import load_results, save_results


def test_every_text_is_in_the_file_once_and_in_every_check_when_read(tmp_path, published):
    save_results(tmp_path, published.results)

    text = (tmp_path / "results.json").read_text()
    because = published.results["cases"][0]["checks"][0]["because"]
    assert text.count(because) == 1
    assert json.loads(text)["cases"][0]["checks"][0]["because"] == 0
    assert load_results(tmp_path)["cases"][0]["checks"][0]["because"] == because


def test_folding_changes_nothing_and_unfolding_takes_what_has_no_table():
    results = {"cases": [{"checks": [{"because": "a"}, {"because": "b"}, {"because": "a"}, {}]}, {}]}

    once = folded(results)
    assert [check.get("because") for check in once["cases"][0]["checks"]] == [0, 1, 0, None]
    assert results["cases"][0]["checks"][0] == {"because": "a"}
    unfold(once)
    assert once == results
    unfold(once)
    assert once == results


def test_a_place_beyond_the_table_says_nothing_rather_than_fail():
    damaged = {"derivations": ["a"], "cases": [{"checks": [{"because": 7}, {"because": -1}]}]}

    unfold(damaged)

    assert [check["because"] for check in damaged["cases"][0]["checks"]] == ["", ""]
