"""`rayproof schema` prints a JSON Schema, the same as the library's."""

import json
from pathlib import Path

from jsonschema import Draft202012Validator

from rayproof.cases.scene_json import schema
from tests.reports.commands.conftest import Rayproof


def test_the_printed_schema_is_valid_json_and_a_valid_schema(rayproof: Rayproof) -> None:
    ended = rayproof("schema")

    assert ended.code == 0
    printed = json.loads(ended.out)
    Draft202012Validator.check_schema(printed)
    assert printed == schema()


def test_the_schema_goes_to_a_file_if_asked(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("schema", "--json", tmp_path / "schema.json")

    assert ended.out == ""
    assert json.loads((tmp_path / "schema.json").read_text()) == schema()
