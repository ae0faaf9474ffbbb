"""`rayproof schema`: the JSON Schema of scene files, or of results.json."""

import json as json_format
from pathlib import Path
from typing import Literal

from rayproof.reports.commands.output import say, write_json


def schema(what: Literal["scene", "results"] = "scene", /, *, json: Path | None = None) -> int:
    """Print the JSON Schema of scene files, or of the results that `rayproof run` writes.

    Parameters
    ----------
    what
        `scene`, or `results` for results.json.
    json
        Write the schema to this file instead.

    """
    if what == "scene":
        from rayproof.cases.scene_schema import schema as described
    else:
        from rayproof.reports.results.records import schema as described
    if json is None:
        for line in json_format.dumps(described(), indent=2).splitlines():
            say(line)
    write_json(json, described())
    return 0
