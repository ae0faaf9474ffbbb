"""What stability and tradeoff left in a folder reaches the report, small and whole; what cannot be read does not."""

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.publish.page.plots import LIBRARY, pages, publish, stability

RUNG = {
    "value": 10.0,
    "rays": 200,
    "false_hits": 1,
    "false_misses": 2,
    "invalid": 3,
    "median": 1.23456789e-7,
    "median_low": 1e-7,
    "median_high": 2e-7,
    "p99": 1e-6,
    "worst": 2e-6,
    "worst_over_Ku": "inf",
}
CLIMB = {
    "ladder": "SPH-FAR",
    "formula": "sphere/haines",
    "precision": "float32",
    "slope": 1.02,
    "slope_interval": [1, 1.1],
    "slope_predicted": 0.98,
    "breakpoint": 1e6,
    "worst_error_over_Ku": 2.2,
    "per_million": {},
    "expected": "pass",
    "verdict": "pass",
    "reasons": [],
    "known": "",
    "surprise": "",
    "values": [RUNG, RUNG | {"value": 100.0}],
}
LADDER = {
    "ladder": "SPH-FAR",
    "group": "sphere",
    "kind": "sweep",
    "slots": ["sphere"],
    "parameter": "distance / radius",
    "values": [10.0, 100.0],
    "unit": "|dt| / r",
    "condition": "K",
    "gate": {"reaches": {"float32": 100.0}},
    "first_to_break": "sphere/textbook",
    "survivor": "",
    "measured": "",
    "laws": [],
}
POINT = {
    "label": "haines, float32",
    "renderer": "tracer",
    "variant": "haines",
    "precision": "float32",
    "kind": "right",
    "nanoseconds": 3.9,
    "nanoseconds_low": 1.9,
    "nanoseconds_high": 4.2,
    "clock": "kernels",
    "error": 0.88,
    "error_low": 0.8,
    "error_high": 0.9,
    "natural": 1e-4,
    "unit": "m",
    "wrong": 0.0,
    "front": True,
}
DIAGRAMS = {
    "repetitions": 5,
    "diagrams": [
        {
            "name": "sphere/sphere",
            "kind": "formulas",
            "svg": "sphere-sphere.svg",
            "time_axis": "ns per ray",
            "points": [POINT],
            "error_axis": "p99 of |dt| / (K u32)",
            "front": ["haines, float32"],
        }
    ],
}


def leave(folder: Path, *, climbs: list[dict[str, Any]]) -> None:
    """Leave in `folder` what the two commands would."""
    for name, content in {
        "stability/ladders.json": ["SPH-FAR"],
        "stability/about.json": {"doubts": [], "quick": True, "environment": {"backend": "llvm"}},
        "stability/SPH-FAR.json": LADDER | {"climbs": climbs},
        "tradeoff/tradeoff.json": DIAGRAMS,
    }.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(json.dumps(content))


def test_the_data_come_as_scripts_with_the_library_beside_them(tmp_path: Path) -> None:
    leave(tmp_path, climbs=[CLIMB])

    written = publish(tmp_path, {})

    assert [path.name for path in written] == ["stability.js", "tradeoff.js", LIBRARY]
    assert pages(tmp_path) == {"stability": "plots/stability.js", "tradeoff": "plots/tradeoff.js"}
    packed = json.loads(written[0].read_text().splitlines()[1])
    found = json.loads(zlib.decompress(base64.b64decode(packed)))
    values = found["ladders"][0]["climbs"][0]["values"]
    assert values["value"] == [10.0, 100.0]
    assert values["wrong"] == [6, 6]
    assert values["median"] == [1.235e-07, 1.235e-07]
    assert values["worst_over_Ku"] == ["inf", "inf"]


@pytest.mark.parametrize("content", ["", "[]", "{}", '["../../secret"]', '["SPH-FAR"]', "[1]", "nan"])
def test_ladders_that_cannot_be_read_are_left_out(tmp_path: Path, content: str) -> None:
    (tmp_path / "stability").mkdir()
    (tmp_path / "stability" / "ladders.json").write_text(content)
    (tmp_path.parent / "secret.json").write_text(json.dumps(LADDER | {"climbs": [CLIMB]}))

    assert stability(tmp_path) is None
