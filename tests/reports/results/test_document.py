"""results.json: written whole, read back, refused in one line."""

import json
import math

import pytest

from rayproof.reports.results.document import ResultsError, load_results, save_results
from rayproof.reports.results.files import plain
from rayproof.reports.results.records import problem
from tests.reports.publish.sample import results_of


def test_what_is_saved_is_what_is_loaded(tmp_path, published):
    save_results(tmp_path, published.results)

    assert load_results(tmp_path) == plain(published.results)


def test_numbers_that_json_cannot_carry_survive_as_strings(tmp_path):
    results = results_of([]) | {"extra": [math.inf, -math.inf, math.nan, 1.5, (2,)]}

    save_results(tmp_path, results)

    assert dict(load_results(tmp_path))["extra"] == ["inf", "-inf", "nan", 1.5, [2]]
    assert json.loads((tmp_path / "results.json").read_text(), parse_constant=pytest.fail)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(lambda group: group["stages"].update(nope={}), "a check: Invalid enum value 'nope'", id="stage"),
        pytest.param(
            lambda group: group["stages"]["ray"].update(ratio="much"), r"\[...\].ratio must be a number$", id="ratio"
        ),
        pytest.param(
            lambda group: group["stages"]["ray"].update(cells=["0"]), "cells must be a list of another", id="cells"
        ),
    ],
)
def test_a_check_that_is_written_wrongly_is_refused_with_its_file(tmp_path, published, change, message):
    document = json.loads((published.folder / "results.json").read_text())
    group = next(group for group in document["cases"][0]["checks"] if "ray" in group["stages"])
    change(group)
    (tmp_path / "results.json").write_text(json.dumps(document))

    with pytest.raises(ResultsError, match=message) as refused:
        load_results(tmp_path)

    assert str(tmp_path / "results.json") in str(refused.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(lambda r: r.update(schema=5), "schema must be 1, got 5", id="schema"),
        pytest.param(lambda r: r["summary"].pop("fail"), "summary.fail is missing", id="ledger"),
        pytest.param(lambda r: r["checks"].update(planned=-1), "checks.planned must be a number >= 0", id="negative"),
        pytest.param(lambda r: r.update(cases={}), "cases must be a list", id="cases"),
        pytest.param(
            lambda r: r["cases"][1].update(verdict="good"), r"cases\[1\].verdict must be one of", id="verdict"
        ),
        pytest.param(lambda r: r["cases"][0].update(name=""), r"cases\[0\].name must be", id="name"),
        pytest.param(lambda r: r["cases"][0].update(checks=3), r"cases\[0\].checks must be a list", id="checks"),
        pytest.param(lambda r: r.pop("coverage"), "coverage is missing", id="coverage"),
        pytest.param(lambda r: r.update(environment=[]), "environment must be an object", id="environment"),
        pytest.param(lambda r: r.update(coverage_detail=None), "coverage_detail must be an object", id="no detail"),
        pytest.param(
            lambda r: r.update(coverage_detail={"HIT-1": 3}),
            r"coverage_detail\[\.\.\.\] must be an object",
            id="detail",
        ),
        pytest.param(lambda r: r.update(verdict=None), "verdict must be a text", id="the run's verdict"),
        pytest.param(lambda r: r.update(faults=5), "faults must be a list", id="faults"),
        pytest.param(lambda r: r.update(configurations=[[1]]), r"configurations\[0\] must be a text", id="lists"),
        pytest.param(lambda r: r.update(references=[[1]]), "references must be an object", id="references"),
        pytest.param(lambda r: r["cases"][0].update(verdict=[]), r"cases\[0\].verdict must be a text", id="no word"),
        pytest.param(lambda r: r["cases"][0].update(notes="x"), r"cases\[0\].notes must be a list", id="notes"),
        pytest.param(lambda r: r["cases"][0].update(picture=5), r"cases\[0\].picture must be a text", id="picture"),
        pytest.param(
            lambda r: r["cases"][0]["checks"][0].update(stages={"ray": {"verdict": {}}}),
            r"cases\[0\].checks\[0\].stages\[\.\.\.\].verdict must be a text",
            id="check's no word",
        ),
        pytest.param(lambda r: r.update(seconds="soon"), "seconds must be a number", id="seconds"),
        pytest.param(lambda r: r.update(seconds=10**400), "seconds must be a number", id="beyond all seconds"),
        pytest.param(
            lambda r: r["cases"][0].update(checks=[3]), r"cases\[0\].checks\[0\] must be an object", id="check"
        ),
        pytest.param(
            lambda r: r["cases"][0].update(renders=[None]), r"cases\[0\].renders\[0\] must be an object", id="render"
        ),
        pytest.param(
            lambda r: r["cases"][0]["checks"][0].update(stages={"ray": {"verdict": "great"}}),
            r"cases\[0\].checks\[0\].stages\[\.\.\.\].verdict must be one of",
            id="check's verdict",
        ),
    ],
)
def test_a_wrong_shape_is_refused_with_file_and_field(tmp_path, published, change, message):
    results = json.loads((published.folder / "results.json").read_text())
    change(results)
    (tmp_path / "results.json").write_text(json.dumps(plain(results)))

    with pytest.raises(ResultsError, match=f"results.json: {message}"):
        load_results(tmp_path)


@pytest.mark.parametrize("seconds", [math.inf, math.nan, True, []])
def test_a_time_that_is_no_number_is_refused(seconds):
    results = results_of([]) | {"seconds": seconds}

    assert str(problem(results)).startswith("seconds must be a number")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        ("{", "not JSON"),
        ("[]", "must be an object"),
        ("[" * 100_000, "not JSON"),
        ("1" * 5000, "not JSON"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_in_one_line(tmp_path, content, message):
    if content is not None:
        (tmp_path / "results.json").write_text(content)

    with pytest.raises(ResultsError, match=message) as refusal:
        load_results(tmp_path)

    assert "\n" not in str(refusal.value)
