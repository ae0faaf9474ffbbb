"""`rayproof list schema` prints a JSON Schema, the same as the library's."""

import json

import pytest
from jsonschema import Draft202012Validator

from rayproof.cases import scene_schema
from rayproof.reports.results import records
from tests.reports.commands.conftest import Rayproof

SCHEMAS = [pytest.param((), scene_schema.schema, id="scene"), pytest.param(("results",), records.schema, id="results")]


@pytest.mark.parametrize(("what", "schema"), SCHEMAS)
def test_the_printed_schema_is_valid_json_and_a_valid_schema(rayproof: Rayproof, what, schema) -> None:
    ended = rayproof("list", "schema", *what)

    assert ended.code == 0
    printed = json.loads(ended.out)
    Draft202012Validator.check_schema(printed)
    assert printed == schema()
    assert len(ended.out.splitlines()) > 100, "a line for each key, to be read by eye"


def test_a_sample_of_results_fits_its_schema(published) -> None:
    document = json.loads((published.folder / "results.json").read_text())

    assert list(Draft202012Validator(records.schema()).iter_errors(document)) == []
