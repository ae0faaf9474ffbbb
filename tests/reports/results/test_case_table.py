"""A run whose records lie in results.sqlite publishes what the same records in memory do, whatever stays in memory."""

import shutil

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.results import case_table, document
from rayproof.reports.results.case_table import NAME, Cases, CaseTable, amend, named
from rayproof.reports.results.document import ResultsError, load_results, save_results, write_results
from rayproof.reports.results.files import plain


@pytest.fixture(params=["all in memory", "none in memory"])
def stored(request, published, tmp_path, monkeypatch):
    """Return a folder whose run is in results.sqlite alone."""
    if request.param == "none in memory":
        monkeypatch.setattr(case_table, "HELD", 0)
    monkeypatch.setattr(document, "LISTED", 0)
    shutil.copytree(published.folder, tmp_path / "stored")
    table = CaseTable(tmp_path / "stored" / NAME)
    for case in published.results["cases"]:
        table.keep(f"key of {case['name']}", plain(case))
    cases = table.arrange(f"key of {case['name']}" for case in published.results["cases"])
    save_results(tmp_path / "stored", {**published.results, "cases": cases})
    table.close()
    return tmp_path / "stored"


def test_a_table_publishes_what_a_list_does(stored, published, tmp_path):
    assert not (stored / "results.json").is_file()
    results = load_results(stored)
    assert isinstance(results["cases"], Cases)
    write_results(tmp_path / "listed.json", results)
    listed = tmp_path / "listed"
    shutil.copytree(stored, listed)
    shutil.copy(tmp_path / "listed.json", listed / "results.json")

    publish_all(stored, results)
    publish_all(listed)

    for name in ("junit.xml", "annotations.txt", "badge.svg", "index.html"):
        assert (stored / name).read_bytes() == (listed / name).read_bytes(), name
    told = (stored / "summary.md").read_text().replace(NAME, "results.json")
    assert told == (listed / "summary.md").read_text()
    assert {path.name: path.read_bytes() for path in (stored / "data").rglob("*.js")} == {
        path.name: path.read_bytes() for path in (listed / "data").rglob("*.js")
    }
    again = load_results(stored)
    assert plain(list(again["cases"])) == plain(list(results["cases"]))


def test_what_is_found_out_later_lies_over_the_record(stored):
    results = load_results(stored)
    amend(results["cases"], results["cases"][1], item="NRM-1", cause=["normals/flipped"])

    (case,) = [one for one in load_results(stored)["cases"] if one["name"] == "sphere/sheared"]

    assert (case["item"], case["cause"]) == ("NRM-1", ["normals/flipped"])
    assert named(results["cases"], "sphere/sheared") == case
    assert case["checks"]


def test_a_run_that_did_not_end_and_a_damaged_file_are_told_in_a_line(stored):
    path = stored / NAME
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(ResultsError, match=r"results\.sqlite: [^\n]*malformed$"):
        load_results(stored)

    path.write_bytes(content)
    table = CaseTable(path)
    table.begin()
    table.close()
    with pytest.raises(ResultsError, match="a run that did not end"):
        load_results(stored)
