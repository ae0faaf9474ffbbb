"""What the front page shows of a run: its totals, coverage, times, and a row of the matrix for each case."""

from pathlib import Path
from typing import Any

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.publish.page.case_data import picture_of, thumbnail_of
from rayproof.reports.publish.page.routes_data import routes_of_run
from rayproof.reports.results.headline import (
    KINDS,
    blame,
    causes,
    examined_line,
    excluded,
    headline,
    no_say,
    shouts,
)
from rayproof.reports.results.item_titles import TITLES
from rayproof.reports.results.json_numbers import number
from rayproof.reports.results.outcomes import LEDGER, Outcome
from rayproof.reports.results.outcomes import worst as worst_outcome
from rayproof.reports.results.ratios import worst_of, worst_ratio
from rayproof.reports.results.records import CaseRecord, CheckRecord, RunRecord

_OF_THE_RUN = (
    "rayproof", "command", "started", "seconds", "verdict", "environment", "configurations", "references", "subject",
    "absent",
)  # fmt: skip
_OF_A_CASE = ("name", "family", "verdict", "stage", "item", "reason", "stresses", "covers", "seconds", "reproduce")


def front_data(results: RunRecord, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the page's data beside the cases' own scripts; `rows` are `case_row`s in the order of the list."""
    details = results.get("coverage_detail", {})
    cases = results["cases"]
    return {
        **{key: results.get(key) for key in _OF_THE_RUN},
        "summary": results["summary"],
        "checks": results["checks"],
        "ledger": LEDGER,
        "shouts": shouts(results),
        "headline": headline(results),
        "causes": causes(results),
        "examined": {"line": examined_line(results), "counts": results.get("examined"), "words": KINDS},
        "no_say": no_say(results),
        "common_factors": results.get("common_factors", []),
        "paths": results.get("paths", {}),
        "routes": routes_of_run(cases),
        "coverage": [
            {"id": item, "what": TITLES.get(item, ""), "cases": count, **details.get(item, {})}
            for item, count in results["coverage"].items()
        ],
        "review": results.get("review", []),
        "stages": [
            {"name": stage.value, "unit": FACTS[stage].unit, "meaning": FACTS[stage].meaning} for stage in Stage
        ],
        "columns": {
            "references": _names(results.get("references") or {}, cases, "reference"),
            "ours": _names(results.get("configurations") or [], cases, "configuration"),
        },
        "times": _times(cases),
        "cases": rows,
    }


def case_row(folder: Path, file: str, case: CaseRecord, cause: str) -> dict[str, Any]:
    """Return what the list of cases shows and searches of one case; `file` holds the rest, `cause` explains it."""
    checks = case.get("checks", [])
    unsupported: dict[str, int] = {}
    for entry in case.get("unsupported", []):
        name = str(entry.get("reference"))
        unsupported[name] = unsupported.get(name, 0) + 1
    cells: dict[str, list[Any]] = {}
    for key in ("reference", "configuration"):
        for name in dict.fromkeys([str(check.get(key)) for check in checks]):
            cells[name] = _cell([check for check in checks if str(check.get(key)) == name], unsupported.get(name, 0))
    for name in unsupported:
        cells.setdefault(name, _cell([], unsupported[name]))
    return {
        **{key: case.get(key) for key in _OF_A_CASE},
        "file": file,
        "blame": blame(case),
        **({"excluded": told} if (told := excluded(case)) else {}),
        "cause": cause,
        "ratio": worst_ratio(case),
        "cells": cells,
        "stages": sorted({str(check["stage"]) for check in checks if check.get("stage")}),
        "picture": picture_of(folder, case),
        **({"thumbnail": small} if (small := thumbnail_of(folder, case)) else {}),
    }


def _cell(checks: list[CheckRecord], unsupported: int) -> list[Any]:
    """Return a renderer's word on a case: worst verdict, checks that have it, all checks, worst ratio, refusals."""
    measured = [check["verdict"] for check in checks if check["verdict"] != Outcome.UNSUPPORTED]
    refused = unsupported + len(checks) - len(measured)
    worst = worst_outcome(map(Outcome, measured)).value if measured else Outcome.UNSUPPORTED.value
    largest = worst_of(checks)
    # Three digits are what is shown.
    return [worst, measured.count(worst), len(checks), None if largest is None else float(f"{largest:.3g}"), refused]


def _names(known: Any, cases: list[CaseRecord], key: str) -> list[str]:
    """Return the renderers that have a column: those that the run names, then those that only cases name."""
    named = [str(entry.get(key)) for case in cases for entry in case.get("checks", []) if entry.get(key) is not None]
    if key == "reference":
        named += [str(entry.get(key)) for case in cases for entry in case.get("unsupported", [])]
    return list(dict.fromkeys([*map(str, known), *named]))


def _times(cases: list[CaseRecord]) -> dict[str, float]:
    """Return how long each renderer took over all cases [s], and judging them."""
    times: dict[str, float] = {}
    for case in cases:
        entries = [(str(render.get("renderer")), number(render.get("seconds"))) for render in case.get("renders", [])]
        for name, seconds in [*entries, ("judging", number(case.get("judge_seconds")))]:
            if seconds is not None:
                times[name] = round(times.get(name, 0.0) + seconds, 3)
    return times
