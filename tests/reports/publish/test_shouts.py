"""Planted faults and broken ledgers stand on the first line of everything that is published."""

from xml.etree import ElementTree

import pytest

from rayproof.reports.publish import PUBLISHERS, publish_all
from rayproof.reports.results.document import save_results
from rayproof.reports.results.headline import shouts
from tests.reports.publish.sample import make_folder, results_of


def test_every_publisher_writes_what_it_says(published):
    for name in PUBLISHERS:
        for path in PUBLISHERS[name](published.folder, published.results):
            assert path.is_file()
            assert path.is_relative_to(published.folder)


@pytest.mark.parametrize("name", ["index.html", "junit.xml", "summary.md"])
def test_planted_faults_stand_on_the_first_line(tmp_path, name):
    save_results(tmp_path, results_of([], faults=("ray/flipped",)))

    publish_all(tmp_path)

    first = (tmp_path / name).read_text().splitlines()[0]
    assert "PLANTED FAULTS" in first
    assert "flipped" in first


def test_a_ledger_that_does_not_add_up_and_an_unfinished_run_are_shouted():
    results = results_of([])
    results["finished"] = False
    results["checks"]["planned"] = 7

    loud = " ".join(shouts(results))

    assert "UNFINISHED" in loud
    assert "7 checks planned, 0 have a verdict" in loud


def test_publishing_again_removes_the_data_of_cases_that_are_gone(tmp_path):
    results = make_folder(tmp_path, extra_cases=2)
    publish_all(tmp_path)
    save_results(tmp_path, results_of(results["cases"][:1]))

    publish_all(tmp_path)

    assert {path.name for path in (tmp_path / "data").iterdir()} == {"0001.js", "0001.pixels.js"}
    assert ElementTree.parse(tmp_path / "junit.xml").getroot().get("tests") == "1"
