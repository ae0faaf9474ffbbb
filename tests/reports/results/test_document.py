"""results.json: written whole, read back, refused in one line."""

import json
import math

import pytest

from rayproof.reports.results.document import ResultsError, load_results, save_results
from rayproof.reports.results.files import plain
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
