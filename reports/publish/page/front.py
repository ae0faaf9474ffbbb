"""The front page's data: totals, coverage, times, a row per case, and the declarations of references."""

import base64
import math
import re
import zlib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.judge.known_defects import known_findings
from rayproof.reports.publish.page.case_data import picture_of, thumbnail_of
from rayproof.reports.publish.page.plots import TimesTable
from rayproof.reports.results.case_records import CaseRecord, Check, worst_of, worst_ratio
from rayproof.reports.results.files import as_json, legible_json, number
from rayproof.reports.results.float_codec import pack_text
from rayproof.reports.results.headline import (
    KINDS,
    FailureGroup,
    blame,
    blame_in_words,
    cause_of,
    causes,
    examined_line,
    excluded,
    failure_groups,
    few_answers,
    headline,
    mended_in,
    remarks,
    shouts,
    standing,
    with_its_name,
)
from rayproof.reports.results.outcomes import LEDGER, TITLES, Outcome
from rayproof.reports.results.outcomes import worst as worst_outcome
from rayproof.reports.results.records import (
    FindingRecord,
    RunRecord,
)
from rayproof.reports.results.wrong_pixels import DISPLAY_NAMES, stated_reason, wrong_pixels

_NUMBER = re.compile(r"[\d.]+(e[-+]?\d+)?")
MOST = 40  # sentences per reference; all are in the records of the cases
FEW = 4  # values shown per setting
MOST_VALUES = 1000  # values counted per setting


class Said:
    """The notes, refusals and settings of a run's references, collected case by case."""

    def __init__(self) -> None:
        # Reference -> sentence with its numbers replaced by "#" -> the first such sentence, and their count.
        self._notes: dict[str, dict[str, tuple[str, int]]] = {}
        self._refusals: dict[str, dict[str, tuple[str, int]]] = {}
        self._settings: dict[str, dict[str, dict[str, None]]] = {}

    def add(self, case: CaseRecord) -> None:
        """Add a case."""
        for key, word, counts in (("notes", "note", self._notes), ("unsupported", "why", self._refusals)):
            for entry in _mappings(case.get(key)):
                sentence, sentences = str(entry.get(word)), counts.setdefault(str(entry.get("reference")), {})
                first, count = sentences.get(alike := _NUMBER.sub("#", sentence), (sentence, 0))
                sentences[alike] = first, count + 1
        for name, settings in _items(case.get("settings")):
            for key, value in _items(settings):
                values = self._settings.setdefault(name, {}).setdefault(key, {})
                if len(values) < MOST_VALUES:
                    values[str(value)] = None

    @property
    def panel(self) -> dict[str, Any]:
        """Return per reference its `settings` (name to all values), `notes` and `unsupported` with their counts."""
        return {
            name: {
                "settings": {key: _few(list(values)) for key, values in self._settings.get(name, {}).items()},
                "notes": _most(self._notes.get(name, {})),
                "unsupported": _most(self._refusals.get(name, {})),
            }
            for name in sorted({*self._notes, *self._refusals, *self._settings})
        }


def findings(results: RunRecord) -> list[FindingRecord]:
    """Return the findings of the run's judgement: from its record, or else the findings of this version."""
    recorded = results.get("findings")
    if isinstance(recorded, list):
        return [_without_checks(entry) for entry in recorded if isinstance(entry, Mapping)]
    return [entry.as_json() for entry in known_findings()]


def _without_checks(finding: FindingRecord) -> FindingRecord:
    left = finding.copy()
    left.pop("met", None)
    return left


def _most(sentences: Mapping[str, tuple[str, int]]) -> list[tuple[str, int]]:
    """Return the most frequent sentences; of sentences that differ only in numbers, the first."""
    return sorted(sentences.values(), key=lambda entry: -entry[1])[:MOST]


def _few(values: list[str]) -> list[str]:
    """Return the first values and the number of further ones, since an epsilon may differ from case to case."""
    more = " or" if len(values) == MOST_VALUES else ""
    return values if len(values) <= FEW else [*values[: FEW - 1], f"{len(values) - FEW + 1}{more} more, by case"]


def _mappings(value: Any) -> list[Mapping[str, Any]]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list) else []


def _items(value: Any) -> list[tuple[str, Any]]:
    return [(str(key), item) for key, item in value.items()] if isinstance(value, Mapping) else []


# A renderer's result for a case: worst verdict, number of checks with it, number of checks, worst ratio, refusals.
Cell = tuple[str, int, int, float | None, int]


class CaseRow(TypedDict):
    """The data of a case in the list of cases."""

    name: str
    family: str
    verdict: str
    stage: str | None
    item: str | None
    reason: str | None
    stresses: str | None
    covers: list[str] | None
    seconds: float | None
    file: str  # path of the case's complete record, relative to the results folder
    blame: str
    items: NotRequired[str]  # the stage and the items with their names
    wrong: NotRequired[str]  # the number of wrong pixels and the size of their errors
    excluded: NotRequired[str]
    cause: str
    ratio: float | None
    cells: dict[str, Cell]  # by renderer
    stages: list[str]
    picture: str | None
    thumbnail: NotRequired[str]


SHARD = 256  # cases per script of rows, and per folder of records


class Front:
    """The front page's data on a run's cases, which are added one by one in the order of the list and not stored.

    For up to `SHARD` cases the page contains all rows. For more it contains deflated columns with the keys for filters
    and sorting, and the rows are in one script per shard, which is loaded when they come into view.
    """

    def __init__(self, folder: Path, results: RunRecord) -> None:
        self._folder, self._results = folder, results
        self.long = len(results["cases"]) > SHARD
        self._rows: dict[int, list[CaseRow]] = {}  # by shard, until `handed_over` returns them
        self._said = Said()
        self._times: dict[str, float] = {}
        self.times = TimesTable()
        self._columns = Columns()
        self._references = dict.fromkeys(map(str, results.get("references") or {}))
        self._configurations = dict.fromkeys(map(str, results.get("configurations") or []))

    def add(self, case: CaseRecord) -> None:
        """Add a case."""
        place = len(self._columns) + 1
        row = case_row(self._folder, data_file(place, long=self.long), case, cause_of(self._results, case))
        self._rows.setdefault((place - 1) // SHARD, []).append(row)
        self._columns.add(row)
        self._said.add(case)
        self.times.add(case)
        # The renderers with a column: first the ones in the run's record, then others that occur only in cases.
        for names, key in ((self._references, "reference"), (self._configurations, "configuration")):
            for check in case.get("checks", []):
                names.setdefault(getattr(check, key))
        for entry in case.get("unsupported", []):
            self._references.setdefault(str(entry.get("reference")))
        entries = [(str(render.get("renderer")), number(render.get("seconds"))) for render in case.get("renders", [])]
        for name, seconds in [*entries, ("judging", number(case.get("judge_seconds")))]:
            if seconds is not None:
                self._times[name] = round(self._times.get(name, 0.0) + seconds, 3)

    def handed_over(self, number: int) -> list[CaseRow]:
        """Return and forget the rows of the shard that contains the case number `number` of the list, from 1."""
        return self._rows.pop((number - 1) // SHARD)

    @property
    def data(self) -> dict[str, Any]:
        """Return the page's data without the cases' scripts; the cases are a `list` of columns, or `cases`."""
        results = self._results
        details = results.get("coverage_detail", {})
        groups, gate = failure_groups(results), results.get("gate")
        front: dict[str, Any] = {
            "rayproof": results.get("rayproof"),
            "command": results.get("command"),
            "started": results.get("started"),
            "seconds": results.get("seconds"),
            "verdict": _tone(results),  # of the gate, if there is one
            "standing": standing(results),
            "environment": results.get("environment"),
            "configurations": results.get("configurations"),
            "references": results.get("references"),
            "subject": results.get("subject"),
            "absent": results.get("absent"),
            "summary": results["summary"],
            "checks": results["checks"],
            "ledger": LEDGER,
            "shouts": shouts(results),
            "headline": headline(results),
            "causes": causes(results),
            "examined": {"line": examined_line(results), "counts": results.get("examined"), "words": KINDS},
            "remarks": remarks(results),
            "groups": {
                "new": [_front_group(group, results) for group in groups if not group.accepted],
                "accepted": [_front_group(group, results) for group in groups if group.accepted],
                "mended": mended_in(gate),
            },
            # Reasons for a red gate other than failures.
            "shut": [] if gate is None else [*gate.get("uncovered", ()), *gate["stale"], *gate["expired"]],
            "gate": gate is not None,
            "display_names": DISPLAY_NAMES,
            "terms": definitions(),
            "common_factors": results.get("common_factors", []),
            "coverage": [
                {"id": item, "what": TITLES.get(item, ""), "cases": count, **details.get(item, {})}
                for item, count in results["coverage"].items()
            ],
            "review": results.get("review", []),
            "stages": [
                {"name": stage.value, "unit": FACTS[stage].unit, "meaning": FACTS[stage].meaning} for stage in Stage
            ],
            "columns": {"references": list(self._references), "ours": list(self._configurations)},
            "times": self._times,  # by renderer [s]
            "panel": self._said.panel,
        }
        if self.long:
            front["list"] = self._columns.packed
        else:
            front["cases"] = self._rows.get(0, [])
        return front


def _front_group(group: FailureGroup, results: RunRecord) -> dict[str, Any]:
    """Return the page's data on cases with the same cause: the first names, and the wrong pixels of the worst case."""
    return {
        "what": group.what,
        "verdict": group.verdict,
        "count": group.count,
        "names": group.names,
        "stage": group.worst.get("stage"),
        "wrong": wrong_pixels(group.worst),
        "reason": with_its_name(results, stated_reason(group.worst)),
    }


_DEFINITION = re.compile(r"^\*\*(.+?)\*\* - (.+)$", re.MULTILINE)


def definitions() -> list[tuple[str, str]]:
    """Return the terms of rayproof with their definitions, in the order of terms.md."""
    text = files("rayproof.reports").joinpath("terms.md").read_text(encoding="utf-8")
    return [(match[1], match[2]) for match in _DEFINITION.finditer(text)]


def _tone(results: RunRecord) -> str | None:
    """Return the verdict for the colour of the page's first line: the gate's, or else the run's.

    It is a warning if few cases were answered, unless the gate is red.
    """
    if "gate" in results and results["gate"]["red"]:
        return Outcome.FAIL.value
    if few_answers(results):
        return Outcome.WARN.value
    if "gate" in results:
        return Outcome.PASS.value
    return results.get("verdict")


class Columns:
    """The keys of all cases for filters and sorting, with one deflated column per key.

    Values that several cases share are stored once in `values`, and the column contains their indices. Numbers have
    the three digits that are shown.
    """

    SHARED = ("verdict", "family", "stage", "item", "blame", "cause", "covers", "stages")
    OWN = ("name", "ratio", "seconds")

    def __init__(self) -> None:
        self._count = 0
        self._texts = {key: Deflated() for key in (*self.SHARED, *self.OWN)}
        self._values: dict[str, dict[str, int]] = {key: {} for key in self.SHARED}
        self._thumbnails: dict[int, str] = {}

    def __len__(self) -> int:
        return self._count

    def add(self, row: CaseRow) -> None:
        """Add the row of a case."""
        for key in self.SHARED:
            values = self._values[key]
            self._texts[key].add(str(values.setdefault(as_json(row.get(key)), len(values))))
        self._texts["name"].add(legible_json(as_json(row["name"])))
        for key in ("ratio", "seconds"):
            value = number(row.get(key))
            self._texts[key].add(as_json(value if value is None or not math.isfinite(value) else float(f"{value:.3g}")))
        if "thumbnail" in row:
            self._thumbnails[self._count] = row["thumbnail"]
        self._count += 1

    @property
    def packed(self) -> dict[str, Any]:
        """Return the columns in the format of html/cases.js; afterwards no row can be added."""
        return {
            "count": self._count,
            "shard": SHARD,
            "values": {key: pack_text(f"[{legible_json(','.join(values))}]") for key, values in self._values.items()},
            "columns": {key: text.packed for key, text in self._texts.items()},
            "thumbnails": self._thumbnails,
        }


class Deflated:
    """A list as JSON, deflated while it grows."""

    def __init__(self) -> None:
        self._deflate = zlib.compressobj(zlib.Z_BEST_COMPRESSION)
        self._parts: list[bytes] = []
        self._between = "["

    def add(self, value: str) -> None:
        """Add a value in JSON."""
        self._parts.append(self._deflate.compress(f"{self._between}{value}".encode()))
        self._between = ","

    @property
    def packed(self) -> str:
        """Return the list deflated and in base64."""
        end = self._deflate.compress(b"]" if self._between == "," else b"[]")
        return base64.b64encode(b"".join([*self._parts, end, self._deflate.flush()])).decode("ascii")


def data_file(number: int, *, long: bool) -> str:
    """Return the path of the record of case number `number` of the list, from 1, relative to the results folder."""
    return f"data/{(number - 1) // SHARD:03}/{number:04}.js" if long else f"data/{number:04}.js"


def rows_file(number: int) -> str:
    """Return the path of the rows of the shard that contains case number `number` of the list, from 1."""
    return f"data/{(number - 1) // SHARD:03}/rows.js"


def case_row(folder: Path, file: str, case: CaseRecord, cause: str) -> CaseRow:
    """Return the row of a case; `file` is the path of its complete record, `cause` the explanation of its failure."""
    checks = case.get("checks", [])
    unsupported: dict[str, int] = {}
    for entry in case.get("unsupported", []):
        name = str(entry.get("reference"))
        unsupported[name] = unsupported.get(name, 0) + 1
    cells: dict[str, Cell] = {}
    for key in ("reference", "configuration"):
        of_name: dict[str, list[Check]] = {}
        for check in checks:
            of_name.setdefault(getattr(check, key), []).append(check)
        for name, checks_of_name in of_name.items():
            cells[name] = _cell(checks_of_name, unsupported.get(name, 0))
    for name in unsupported:
        cells.setdefault(name, _cell([], unsupported[name]))
    row: CaseRow = {
        "name": case["name"],
        "family": case["family"],
        "verdict": case["verdict"],
        "stage": case.get("stage"),
        "item": case.get("item"),
        "reason": None if case.get("reason") is None else stated_reason(case),
        "stresses": case.get("stresses"),
        "covers": case.get("covers"),
        "seconds": case.get("seconds"),
        "file": file,
        "blame": blame(case),
        "excluded": excluded(case),
        "cause": cause,
        "ratio": worst_ratio(case),
        "cells": cells,
        "stages": sorted({check.stage for check in checks if check.stage}),
        "picture": picture_of(folder, case),
    }
    if not row["excluded"]:
        del row["excluded"]
    if row["blame"]:
        row["items"] = blame_in_words(case)
    if wrong := wrong_pixels(case):
        row["wrong"] = wrong
    if small := thumbnail_of(folder, case):
        row["thumbnail"] = small
    return row


def _cell(checks: list[Check], unsupported: int) -> Cell:
    measured = [check.outcome for check in checks if check.outcome != Outcome.UNSUPPORTED]
    refused = unsupported + len(checks) - len(measured)
    worst = worst_outcome({*measured}) if measured else Outcome.UNSUPPORTED
    largest = worst_of(checks)
    # Three digits are shown.
    return worst, measured.count(worst), len(checks), None if largest is None else float(f"{largest:.3g}"), refused
