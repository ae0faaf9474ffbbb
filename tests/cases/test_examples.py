"""The examples are scenes that a user could have written: valid by reader and schema, small, one with a mesh file."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from rayproof.cases.scene_json import load_scene
from rayproof.cases.scene_schema import schema

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_an_example_is_a_valid_scene(path):
    scene = load_scene(path)

    assert scene.shapes
    assert scene.lights
    assert Draft202012Validator(schema()).is_valid(json.loads(path.read_text()))
