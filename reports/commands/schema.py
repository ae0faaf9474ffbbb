"""`rayproof schema`: the JSON Schema of scene files."""

import json as json_format
from pathlib import Path

from rayproof.reports.commands.output import say, write_json


def schema(*, json: Path | None = None) -> int:
    """Print the JSON Schema of scene files.

    Parameters
    ----------
    json
        Write the schema to this file instead.

    """
    from rayproof.cases.scene_json import schema as scene_schema

    if json is None:
        say(json_format.dumps(scene_schema(), indent=2))
    write_json(json, scene_schema())
    return 0
