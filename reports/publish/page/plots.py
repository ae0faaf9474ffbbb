"""Plots of `rayproof stability` and `rayproof tradeoff`, as data for the report's pages.

Plotly is written once if there is anything to plot; a page loads it and its data when it is opened.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

from rayproof.reports.publish.page.case_data import vendored
from rayproof.reports.results.case_records import CaseRecord, Check, ratio_of
from rayproof.reports.results.files import at_worst, number, write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.images import script
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.reports.studies.stability.limit_records import LimitsError, bars, load_limits, place_of

if TYPE_CHECKING:
    from rayproof.reports.studies.tradeoff.points import TradeoffRecord

FOLDER, TIMES = "plots", "times"
LIBRARY = "plotly-basic.min.js"
DIGITS = 4  # of a plotted number; more than a plot of 1000 px can show
# The keys of a sweep that the page shows unchanged.
CLIMB = (
    "formula", "precision", "slope", "slope_interval", "slope_predicted", "breakpoint", "worst_error_over_Ku",
    "per_million", "expected", "verdict", "reasons", "known", "surprise",
)  # fmt: skip
_COUNTED = ("false_hits", "false_misses", "invalid")
_SIZES = ("median", "median_low", "median_high", "p99", "worst", "worst_over_Ku")


class TimesTable:
    """Errors and render times per case, configuration and reference, collected in the order of the list of cases."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, int]] = {"configuration": {}, "reference": {}, "stage": {}}
        self._cases = 0
        self.rows: list[list[Any]] = []

    def add(self, case: CaseRecord) -> None:
        """Add a case."""
        worst: dict[str, dict[str, Check]] = {}
        for check in case.get("checks", []):
            if ratio_of(check) is not None and check.outcome in MEASURED:
                of = worst.setdefault(check.configuration, {})
                reference = check.reference
                if reference not in of or _size(of[reference]) < _size(check):
                    of[reference] = check
        renders = [render for render in case.get("renders", []) if not render.get("cached")]
        reference_times = {str(render.get("renderer")): _milliseconds(render.get("seconds")) for render in renders}
        for render in renders:
            checks = worst.get(str(render.get("configuration")), {})
            launches = render.get("launches") or 0
            time = _milliseconds(render.get("kernels") if launches else render.get("seconds"))
            if time and checks:
                reference_rows = [
                    [
                        self._place("reference", name),
                        _three(check),
                        self._place("stage", check.stage),
                        reference_times.get(name),
                    ]
                    for name, check in checks.items()
                ]
                self.rows.append(
                    [self._cases, self._place("configuration", render["configuration"]), time, launches, reference_rows]
                )
        self._cases += 1

    def _place(self, kind: str, name: Any) -> int:
        names = self._names[kind]
        return names.setdefault(str(name), len(names))

    @property
    def data(self) -> dict[str, Any]:
        """Return the data of the plot of errors against times; names are indices into lists.

        There is a row per case and configuration: the index of the case from 0, the configuration, the time [ms], the
        number of launches whose median it is (0: a single time of the whole render), and a list per reference with its
        index, the worst error / limit, the stage of this error, and the reference's render time [ms], null if its
        images were cached.
        """
        configurations, references, stages = (list(names) for names in self._names.values())
        return {"configurations": configurations, "references": references, "stages": stages, "rows": self.rows}


MEASURED = (Outcome.PASS, Outcome.WARN, Outcome.FAIL, Outcome.REFERENCE_SUSPECT)


def _size(check: Check) -> float:
    ratio = ratio_of(check)
    return 0.0 if ratio is None else at_worst(ratio)


def _three(check: Check) -> float | str:
    """Return the error / limit of a check with the three digits that are shown."""
    size = _size(check)
    return float(f"{size:.3g}") if math.isfinite(size) else "inf"


def _milliseconds(seconds: Any) -> float | None:
    value = number(seconds)
    return None if value is None else float(f"{1000 * value:.3g}")


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write plots/*.js for the studies in the folder, and the library; `write_times` writes plots/times.js."""
    written = [
        write_text(folder / data_of(name), script(data_of(name), pack_json(data)))
        for name, load in SOURCES.items()
        if (data := load(folder)) is not None
    ]
    if written or (folder / data_of(TIMES)).is_file():
        written.append(write_text(folder / FOLDER / LIBRARY, vendored(LIBRARY)))
    # Remove files of an earlier publication with more plots.
    for stale in {folder / name for name in (*map(data_of, SOURCES), f"{FOLDER}/{LIBRARY}")} - set(written):
        stale.unlink(missing_ok=True)
    return written


def pages(folder: Path) -> dict[str, str]:
    """Return the existing plots: the page's name -> the script with its data."""
    scripts = {name: data_of(name) for name, load in SOURCES.items() if load(folder) is not None}
    return scripts | ({TIMES: data_of(TIMES)} if (folder / data_of(TIMES)).is_file() else {})


def write_times(folder: Path, times: TimesTable) -> list[Path]:
    """Write plots/times.js, or remove an earlier one if there are no times."""
    if not times.rows:
        (folder / data_of(TIMES)).unlink(missing_ok=True)
        return []
    return [write_text(folder / data_of(TIMES), script(data_of(TIMES), pack_json(times.data)))]


def data_of(name: str) -> str:
    """Return the path of a page's data, relative to the results folder."""
    return f"{FOLDER}/{name}.js"


def stability(folder: Path) -> dict[str, Any] | None:
    """Return the measured ladders, with numbers rounded for drawing; None if there are none."""
    place = folder / "stability"
    names = _read(place / "ladders.json")
    if not isinstance(names, list):
        return None
    contents = [_read(place / f"{name}.json") for name in names if isinstance(name, str) and Path(name).name == name]
    ladders = [_ladder(content) for content in contents if _is_ladder(content)]
    about = _read(place / "about.json")
    if not ladders:
        return None
    return {"ladders": ladders, "about": about if _is_survey(about) else {}}


def tradeoff(folder: Path) -> TradeoffRecord | None:
    """Return the work-precision diagrams, with numbers rounded for drawing; None if there are none."""
    content = _read(folder / "tradeoff" / "tradeoff.json")
    if not isinstance(content, dict) or not isinstance(content.get("diagrams"), list) or not content["diagrams"]:
        return None
    return _rounded(content)


def worst(folder: Path) -> dict[str, Any] | None:
    """Return the worst inputs of `rayproof worst`; None if there are none."""
    content = _read(folder / "stability" / "worst.json")
    return content if _is_search(content) else None


def limits(folder: Path) -> dict[str, Any] | None:
    """Return the measurements of `rayproof limits`; None if there are none in the folder."""
    place = place_of(folder)
    try:
        return _rounded(bars(load_limits(place)))
    except (OSError, LimitsError):
        return None


SOURCES: dict[str, Callable[[Path], Any]] = {
    "stability": stability,
    "worst": worst,
    "limits": limits,
    "tradeoff": tradeoff,
}


def _is_ladder(content: Any) -> TypeGuard[dict[str, Any]]:
    """Return whether a file's content is a ladder with a list of sweeps."""
    return isinstance(content, dict) and isinstance(content.get("climbs"), list)


def _is_search(content: Any) -> TypeGuard[dict[str, Any]]:
    return isinstance(content, dict) and isinstance(content.get("formulas"), list)


def _is_survey(about: Any) -> TypeGuard[dict[str, Any]]:
    return isinstance(about, dict)


def _ladder(ladder: dict[str, Any]) -> dict[str, Any]:
    return _rounded({**ladder, "climbs": [_climb(climb) for climb in ladder["climbs"] if isinstance(climb, dict)]})


def _climb(climb: dict[str, Any]) -> dict[str, Any]:
    """Return a sweep with its values as columns, which reduces the text to a quarter."""
    values = [value for value in climb.get("values", []) if isinstance(value, dict)]
    columns: dict[str, list[float | None]] = {
        name: [value.get(name) for value in values] for name in ("value", "rays", *_SIZES)
    }
    columns["wrong"] = [sum(int(number(value.get(name)) or 0) for name in _COUNTED) for value in values]
    return {key: climb.get(key) for key in CLIMB} | {"values": columns}


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value


def _read(path: Path) -> Any:
    """Return the content of a JSON file, or None if it cannot be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
