"""A results folder that has something for every page of the report."""

import json
from pathlib import Path

from rayproof.reports.publish import publish_all
from rayproof.reports.results.document import save_results
from tests.reports.publish.page.test_formula_comparison import FOUND
from tests.reports.publish.page.test_plots import CLIMB, leave
from tests.reports.publish.sample import make_folder
from tests.reports.publish.test_history_page import history

PAGES = ("stability", "tradeoff", "references", "history", "contest")
HOSTILE = "sphere/<a href='http://x'>%{x}<b>"


def make_everything(folder: Path) -> None:
    """Fill `folder` with plots, a comparison of formulas and a history; publish it."""
    results = make_folder(folder)
    results["cases"] = results["cases"][:2]
    results["references"]["analytic"]["version"] = "numpy <b>2</b>"
    results["absent"] = {"radiance": "It is under test."}
    for case in results["cases"]:
        case["notes"] = [{"reference": "mitsuba_scalar", "note": "a disc for a plane"}]
        case["settings"] = {"mitsuba_scalar": {"ray epsilon": "0.001 m"}}
    finding = {
        "reference": "mitsuba_scalar",
        "version": "3",
        "where": "size_over_distance",
        "at_least": 94.0,
        "what": "loses digits",
        "third_witness": "a",
    }
    scene = {"smallest_scene": "examples/findings/<b>.json"}
    results["findings"] = [finding | scene | {"stage": stage} for stage in ("normal", "radiance")]
    results["findings"].append(finding | {"stage": "ray", "smallest_scene": "sphere/plain"})
    save_results(folder, results | {"history": json.loads(json.dumps(history()))})
    leave(folder, climbs=[CLIMB, CLIMB | {"formula": HOSTILE, "verdict": "fail", "surprise": "it broke"}])
    (folder / "comparison.json").write_text(json.dumps(FOUND))
    publish_all(folder)
