"""plots/: what `rayproof stability`, `tradeoff` and `bench` left in the folder, as scripts for the report's pages.

Plotly comes beside them once, where there is anything to plot; the pages load all of it when they are opened.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rayproof.reports.publish import PUBLISHERS
from rayproof.reports.publish.page.viewer_page import vendored
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.image_script import script
from rayproof.reports.results.json_numbers import number
from rayproof.reports.results.records import RunRecord

FOLDER = "plots"
LIBRARY = "plotly-basic.min.js"
DIGITS = 4
_COUNTED = ("false_hits", "false_misses", "invalid")
_SIZES = ("median", "median_low", "median_high", "p99", "worst", "worst_over_Ku")
_OF_A_CLIMB = (
    "formula", "precision", "slope", "slope_interval", "slope_predicted", "breakpoint", "worst_error_over_Ku",
    "per_million", "expected", "verdict", "reasons", "known", "surprise",
)  # fmt: skip


@PUBLISHERS.register("plots")
def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write plots/*.js for what was measured, and the library; nothing where there is nothing to plot."""
    written = [
        write_text(folder / data_of(name), script(data_of(name), pack_json(found)))
        for name, load in SOURCES.items()
        if (found := load(folder)) is not None
    ]
    if written:
        written.append(write_text(folder / FOLDER / LIBRARY, vendored(LIBRARY)))
    # Of an earlier publication, when there was more to plot.
    for stale in {folder / name for name in (*map(data_of, SOURCES), f"{FOLDER}/{LIBRARY}")} - set(written):
        stale.unlink(missing_ok=True)
    return written


def pages(folder: Path) -> dict[str, str]:
    """Return which plots there are: the page's name to the script with its data."""
    return {name: data_of(name) for name, load in SOURCES.items() if load(folder) is not None}


def data_of(name: str) -> str:
    """Return where a page's data are, relative to the results folder."""
    return f"{FOLDER}/{name}.js"


def stability(folder: Path) -> dict[str, Any] | None:
    """Return the ladders that were climbed, numbers rounded for drawing; None without any."""
    place = folder / "stability"
    names = _read(place / "ladders.json")
    if not isinstance(names, list):
        return None
    found = [_read(place / f"{name}.json") for name in names if isinstance(name, str) and Path(name).name == name]
    ladders = [_ladder(one) for one in found if isinstance(one, dict) and isinstance(one.get("climbs"), list)]
    about = _read(place / "about.json")
    return {"ladders": ladders, "about": about if isinstance(about, dict) else {}} if ladders else None


def tradeoff(folder: Path) -> dict[str, Any] | None:
    """Return the work-precision diagrams, numbers rounded for drawing; None without any."""
    found = _read(folder / "tradeoff" / "tradeoff.json")
    if not isinstance(found, dict) or not isinstance(found.get("diagrams"), list) or not found["diagrams"]:
        return None
    return _rounded(found)


def bench(folder: Path) -> dict[str, Any] | None:
    """Return the benchmark, as docs/bench.md describes it, numbers rounded for drawing; None without any."""
    found = _read(folder / "bench.json")
    scenes = _mappings(found.get("scenes")) if isinstance(found, dict) else []
    if not scenes or not all(map(_is_scene, scenes)):
        return None
    shown = [{**scene, "contenders": _mappings_in(scene.get("contenders"))} for scene in scenes]
    about = {name: found[name] if isinstance(found.get(name), dict) else {} for name in ("machine", "versions")}
    changes = [change for change in _mappings(found.get("changes")) if isinstance(change.get("interval"), list)]
    return _rounded({"started": found.get("started"), **about, "scenes": shown, "changes": changes})


def _is_scene(scene: dict[str, Any]) -> bool:
    """Return whether a scene of a benchmark has a size, and intervals that are pairs."""
    sized = all(isinstance(scene.get(key), int) and scene[key] > 0 for key in ("width", "height"))
    pairs = (scene.get(f"{key}_interval") for key in ("ratio_minimal", "ratio_direct", "control"))
    return sized and all(pair is None or (isinstance(pair, list) and len(pair) == 2) for pair in pairs)


def _mappings(value: Any) -> list[dict[str, Any]]:
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list) else []


def _mappings_in(value: Any) -> dict[str, dict[str, Any]]:
    return {name: one for name, one in value.items() if isinstance(one, dict)} if isinstance(value, dict) else {}


SOURCES: dict[str, Callable[[Path], dict[str, Any] | None]] = {
    "stability": stability,
    "tradeoff": tradeoff,
    "bench": bench,
}


def _ladder(one: dict[str, Any]) -> dict[str, Any]:
    climbs = [climb for climb in one["climbs"] if isinstance(climb, dict)]
    return _rounded(one | {"climbs": [_climb(climb) for climb in climbs]})


def _climb(climb: dict[str, Any]) -> dict[str, Any]:
    """Return a climb with its values as columns, which is a quarter of the text."""
    values = [value for value in climb.get("values", []) if isinstance(value, dict)]
    counted = [sum(int(number(value.get(name)) or 0) for name in _COUNTED) for value in values]
    columns = {name: [value.get(name) for value in values] for name in ("value", "rays", *_SIZES)}
    return {key: climb.get(key) for key in _OF_A_CLIMB} | {"values": columns | {"wrong": counted}}


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value


def _read(path: Path) -> Any:
    """Return what a JSON file holds, or None where there is none that can be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
