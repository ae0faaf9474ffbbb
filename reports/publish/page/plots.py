"""Plots of `rayproof stability` and `rayproof tradeoff`, as data for the report's pages.

Plotly comes beside them once, where there is anything to plot; the pages load all of it when they are opened.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeGuard

from rayproof.reports.publish.page.case_data import vendored
from rayproof.reports.results.case_records import CaseRecord, Check, ratio_of
from rayproof.reports.results.files import at_worst, number, write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.images import script
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.reports.studies.stability.limit_records import LimitsError, LimitsPlot, bars, load_limits, place_of
from rayproof.reports.studies.stability.records import LadderAbout

if TYPE_CHECKING:
    from rayproof.reports.studies.stability.records import ClimbRecord, LadderRecord, SurveyAbout, WorstSearch
    from rayproof.reports.studies.tradeoff.points import TradeoffRecord

FOLDER, TIMES = "plots", "times"
LIBRARY = "plotly-basic.min.js"
DIGITS = 4  # of a plotted number: more than a plot of 1000 px can show
_COUNTED = ("false_hits", "false_misses", "invalid")
_SIZES = ("median", "median_low", "median_high", "p99", "worst", "worst_over_Ku")


class ClimbPlot(TypedDict):
    """A climb, its values as columns, which is a quarter of the text."""

    formula: str
    precision: str
    slope: float | None
    slope_interval: list[float] | None
    slope_predicted: float | None
    breakpoint: float | None
    worst_error_over_Ku: float | None
    per_million: dict[str, float]
    expected: str
    verdict: str
    reasons: list[str]
    known: str
    surprise: str
    values: dict[str, list[float | None]]


class LadderPlot(LadderAbout):
    """A ladder with its climbs."""

    climbs: list[ClimbPlot]


class NotTold(TypedDict):
    """A value that a file does not have."""


class StabilityPlot(TypedDict):
    """The ladders that were climbed."""

    ladders: list[LadderPlot]
    about: SurveyAbout | NotTold


class TimesPlot(TypedDict):
    """Errors against times of what a run measured; names are told by their places in the lists."""

    configurations: list[str]
    references: list[str]
    stages: list[str]
    # A row a case and configuration: the case's place in the list from 0, the configuration, the time [ms], of how many
    # launches it is the median (0: the whole render, once), and of each reference its place, the worst error over its
    # limit, the stage of that, and the time of its own render [ms], null if it was not rendered now.
    rows: list[list[Any]]


class Times:
    """What each case, configuration and reference came to, taken up case by case in the order of the list."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, int]] = {"configuration": {}, "reference": {}, "stage": {}}
        self._cases = 0
        self.rows: list[list[Any]] = []

    def add(self, case: CaseRecord) -> None:
        """Take up another case."""
        worst: dict[str, dict[str, Check]] = {}
        for check in case.get("checks", []):
            if ratio_of(check) is not None and check.outcome in MEASURED:
                of = worst.setdefault(check.configuration, {})
                reference = check.reference
                if reference not in of or _size(of[reference]) < _size(check):
                    of[reference] = check
        renders = [render for render in case.get("renders", []) if not render.get("cached")]
        theirs = {str(one.get("renderer")): _milliseconds(one.get("seconds")) for one in renders}
        for render in renders:
            checks = worst.get(str(render.get("configuration")), {})
            launches = render.get("launches") or 0
            time = _milliseconds(render.get("kernels") if launches else render.get("seconds"))
            if time and checks:
                each = [
                    [
                        self._place("reference", name),
                        _three(check),
                        self._place("stage", check.stage),
                        theirs.get(name),
                    ]
                    for name, check in checks.items()
                ]
                self.rows.append(
                    [self._cases, self._place("configuration", render["configuration"]), time, launches, each]
                )
        self._cases += 1

    def _place(self, kind: str, name: Any) -> int:
        names = self._names[kind]
        return names.setdefault(str(name), len(names))

    @property
    def data(self) -> TimesPlot:
        """Return what the page draws."""
        configurations, references, stages = (list(names) for names in self._names.values())
        return {"configurations": configurations, "references": references, "stages": stages, "rows": self.rows}


MEASURED = (Outcome.PASS, Outcome.WARN, Outcome.FAIL, Outcome.REFERENCE_SUSPECT)


def _size(check: Check) -> float:
    ratio = ratio_of(check)
    return 0.0 if ratio is None else at_worst(ratio)


def _three(check: Check) -> float | str:
    """Return an error over its limit with the three digits that are shown."""
    size = _size(check)
    return float(f"{size:.3g}") if math.isfinite(size) else "inf"


def _milliseconds(seconds: Any) -> float | None:
    value = number(seconds)
    return None if value is None else float(f"{1000 * value:.3g}")


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write plots/*.js for what was measured by studies, and the library; errors and times are in plots/times.js."""
    written = [
        write_text(folder / data_of(name), script(data_of(name), pack_json(found)))
        for name, load in SOURCES.items()
        if (found := load(folder)) is not None
    ]
    if written or (folder / data_of(TIMES)).is_file():
        written.append(write_text(folder / FOLDER / LIBRARY, vendored(LIBRARY)))
    # Of an earlier publication, when there was more to plot.
    for stale in {folder / name for name in (*map(data_of, SOURCES), f"{FOLDER}/{LIBRARY}")} - set(written):
        stale.unlink(missing_ok=True)
    return written


def pages(folder: Path) -> dict[str, str]:
    """Return which plots there are: the page's name to the script with its data."""
    found = {name: data_of(name) for name, load in SOURCES.items() if load(folder) is not None}
    return found | ({TIMES: data_of(TIMES)} if (folder / data_of(TIMES)).is_file() else {})


def write_times(folder: Path, times: Times) -> list[Path]:
    """Write plots/times.js, or remove that of an earlier publication where nothing was measured."""
    if not times.rows:
        (folder / data_of(TIMES)).unlink(missing_ok=True)
        return []
    return [write_text(folder / data_of(TIMES), script(data_of(TIMES), pack_json(times.data)))]


def data_of(name: str) -> str:
    """Return where a page's data are, relative to the results folder."""
    return f"{FOLDER}/{name}.js"


def stability(folder: Path) -> StabilityPlot | None:
    """Return the ladders that were climbed, numbers rounded for drawing; None without any."""
    place = folder / "stability"
    names = _read(place / "ladders.json")
    if not isinstance(names, list):
        return None
    found = [_read(place / f"{name}.json") for name in names if isinstance(name, str) and Path(name).name == name]
    ladders = [_ladder(one) for one in found if _is_ladder(one)]
    about = _read(place / "about.json")
    if not ladders:
        return None
    return {"ladders": ladders, "about": about if _is_survey(about) else {}}


def tradeoff(folder: Path) -> TradeoffRecord | None:
    """Return the work-precision diagrams, numbers rounded for drawing; None without any."""
    found = _read(folder / "tradeoff" / "tradeoff.json")
    if not isinstance(found, dict) or not isinstance(found.get("diagrams"), list) or not found["diagrams"]:
        return None
    return _rounded(found)


def worst(folder: Path) -> WorstSearch | None:
    """Return the worst inputs that were searched for; None where none were."""
    found = _read(folder / "stability" / "worst.json")
    return found if _is_search(found) else None


def limits(folder: Path) -> LimitsPlot | None:
    """Return how far renderers carry; None where no limits lie there."""
    place = place_of(folder)
    try:
        return _rounded(bars(load_limits(place)))
    except (OSError, LimitsError):
        return None


SOURCES: dict[str, Callable[[Path], StabilityPlot | WorstSearch | LimitsPlot | TradeoffRecord | None]] = {
    "stability": stability,
    "worst": worst,
    "limits": limits,
    "tradeoff": tradeoff,
}


def _is_ladder(one: Any) -> TypeGuard[LadderRecord]:
    """Return whether a file's content is a ladder with its climbs, as far as the page depends on it."""
    return isinstance(one, dict) and isinstance(one.get("climbs"), list)


def _is_search(found: Any) -> TypeGuard[WorstSearch]:
    return isinstance(found, dict) and isinstance(found.get("formulas"), list)


def _is_survey(about: Any) -> TypeGuard[SurveyAbout]:
    return isinstance(about, dict)


def _ladder(one: LadderRecord) -> LadderPlot:
    climbs = [_climb(climb) for climb in one["climbs"] if isinstance(climb, dict)]
    shown: LadderPlot = {**one, "climbs": climbs}
    return _rounded(shown)


def _climb(climb: ClimbRecord) -> ClimbPlot:
    values = [value for value in climb.get("values", []) if isinstance(value, dict)]
    columns: dict[str, list[float | None]] = {
        name: [value.get(name) for value in values] for name in ("value", "rays", *_SIZES)
    }
    columns["wrong"] = [sum(int(number(value.get(name)) or 0) for name in _COUNTED) for value in values]
    return {
        "formula": climb.get("formula"),
        "precision": climb.get("precision"),
        "slope": climb.get("slope"),
        "slope_interval": climb.get("slope_interval"),
        "slope_predicted": climb.get("slope_predicted"),
        "breakpoint": climb.get("breakpoint"),
        "worst_error_over_Ku": climb.get("worst_error_over_Ku"),
        "per_million": climb.get("per_million"),
        "expected": climb.get("expected"),
        "verdict": climb.get("verdict"),
        "reasons": climb.get("reasons"),
        "known": climb.get("known"),
        "surprise": climb.get("surprise"),
        "values": columns,
    }


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
