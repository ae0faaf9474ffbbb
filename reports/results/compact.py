"""results.json without repetition: `compact` and `expand` of what checks share.

Tens of thousands of checks share a few hundred derivations, most pass with every pixel held strictly, and a third of a
measurement is counts of what never was. `publish/page/html/records.js` undoes in the page what `expand` undoes here.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, cast

from rayproof.reports.results.case_records import (
    AdjudicationRecord,
    CaseRecord,
    CheckFacts,
    CheckGroupRecord,
    CheckRecord,
    MeasurementRecord,
    RenderRecord,
    WrittenCaseRecord,
    WrittenCheckRecord,
)
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

TABLE = "derivations"
MEASUREMENTS: tuple[Literal["end_to_end", "continued"], ...] = ("end_to_end", "continued")
# Of a measurement: left out where it is 0.
COUNTS = (
    "over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss",
    "nan", "inf", "flagged",
)  # fmt: skip
RENDERED = (("error", None), ("cached", False))  # usual of a render, and left out
# Of a stage's matrix: left out where it is that of the first stage.
SHARED: tuple[Literal["baseline", "renderers"], ...] = ("baseline", "renderers")
NUMBERS = ("worst_ratio", "worst_error", "limit", "ulp")  # likewise
# Of the pixels that a check examined: left out where it is 0. `strict` is what is left of `pixels`, which are those of
# the image where they are not there.
KINDS = ("wide", "side", "interval", "epsilon", "wrong", "unexamined")


def compact(record: CaseRecord, places: dict[str, int]) -> WrittenCaseRecord:
    """Return a case's record as it is written; texts become their places among `places`, which new ones join."""
    written = cast("WrittenCaseRecord", dict(record))
    if "checks" in record:
        groups: dict[tuple[str, str], CheckGroupRecord] = {}
        because: dict[str, dict[str, int]] = {}
        for check in record["checks"]:
            of = check.get("configuration", ""), check.get("reference", "")
            group = groups.setdefault(of, {"configuration": of[0], "reference": of[1], "stages": {}})
            place = places.setdefault(str(check["because"]), len(places)) if "because" in check else None
            stage = check.get("stage", "")
            usual = because.setdefault(of[1], {}).setdefault(stage, place) if place is not None else None
            group["stages"][stage] = _without_the_usual(check, _pixels(record), None if place == usual else place)
        written["checks"] = list(groups.values())
        written["because"] = because
    if "renders" in record:
        renders = ([pair for pair in render.items() if pair not in RENDERED] for render in record["renders"])
        written["renders"] = [cast("RenderRecord", dict(pairs)) for pairs in renders]
    if panel := record.get("adjudication"):
        first = next(iter(panel.values()))
        written["adjudication"] = {
            stage: _unlike(first, _agreeing(matrix)) if matrix is not first else _agreeing(matrix)
            for stage, matrix in panel.items()
        }
    return written


def compact_case(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case's record the same way, with a table of its own; html/records.js is the inverse."""
    places: dict[str, int] = {}
    return {"checks": [], **compact(cast("CaseRecord", record), places), TABLE: list(places)}


def expand(results: RunRecord) -> None:
    """Put back what `compact` left out, in place; results that leave nothing out stay as they are."""
    table = results.pop(TABLE, None) or []
    for case in results["cases"]:
        because = cast("dict[str, Any]", case).pop("because", None) or {}
        if "checks" in case:
            case["checks"] = list(_checks(case, because, table))
        for render in case.get("renders", []):
            for name, value in RENDERED:
                cast("dict[str, Any]", render).setdefault(name, value)
        panel = case.get("adjudication") or {}
        first = next(iter(panel.values()), None)
        for matrix in panel.values():
            _square(matrix)
            for name in SHARED:
                if first is not None and name in first and name not in matrix:
                    cast("dict[str, Any]", matrix)[name] = first[name]


def _checks(case: CaseRecord, because: Mapping[str, Any], table: list[str]) -> Iterator[CheckRecord]:
    for entry in case["checks"]:
        grouped = isinstance(entry, dict) and "stages" in entry
        for stage, check in cast("CheckGroupRecord", entry)["stages"].items() if grouped else (("", entry),):
            if grouped:
                of = cast("CheckGroupRecord", entry)
                told = {"configuration": of["configuration"], "reference": of["reference"], "stage": stage}
                usual = because.get(of["reference"], {}).get(stage)
                check = cast("WrittenCheckRecord", {**told, **({} if usual is None else {"because": usual}), **check})
                check.setdefault("verdict", Outcome.PASS.value)
                _examined(check, _pixels(case))
            place = check.get("because")
            if isinstance(place, int) and not isinstance(place, bool):
                check["because"] = str(table[place]) if 0 <= place < len(table) else ""
            check.setdefault("reason", "")
            for name in MEASUREMENTS:
                measured = check.setdefault(name, None)
                if name == "continued" and measured == {} and check["end_to_end"]:
                    measured = check[name] = check["end_to_end"].copy()
                if isinstance(measured, dict):
                    _complete(measured, _pixels(case))
            whole = check["end_to_end"]
            if "ratio" not in check and isinstance(whole, dict):
                check["ratio"] = whole.get("worst_ratio") or 0.0
            yield cast("CheckRecord", check)


def _without_the_usual(check: CheckRecord, pixels: int, because: int | None) -> WrittenCheckRecord:
    """Return a check without where it stands, and without what `expand` knows; `because` is a derivation of its own."""
    left = cast("dict[str, Any]", dict(check))
    for name in ("configuration", "reference", "stage", "because"):
        left.pop(name, None)
    if because is not None:
        left["because"] = because
    if left.get("reason") == "":
        del left["reason"]
    if left.get("verdict") == Outcome.PASS:
        del left["verdict"]
    for name in MEASUREMENTS:
        measured: MeasurementRecord | None = left.get(name)
        if measured is None:
            left.pop(name, None)
        else:
            if name == "continued" and measured == check.get("end_to_end"):
                left[name] = {}
                continue
            if name == "end_to_end" and "ratio" in left and left["ratio"] == measured.get("worst_ratio"):
                del left["ratio"]
            # None at all would be that of end to end.
            left[name] = _terse(measured, pixels) or {"interior": measured["interior"]}
    examined = left.get("examined")
    if examined is None:
        left["examined"] = None
    else:
        left["examined"] = {name: examined[name] for name in KINDS if examined.get(name)}
        if examined.get("pixels") != pixels:
            left["examined"]["pixels"] = examined.get("pixels", 0)
        if not left["examined"]:
            del left["examined"]
    return cast("WrittenCheckRecord", left)


def _examined(check: CheckFacts, pixels: int) -> None:
    counts = check.get("examined", {})
    if counts is not None:
        every = {"pixels": pixels, **dict.fromkeys(KINDS, 0), **counts}
        check["examined"] = every | {"strict": every["pixels"] - sum(every[name] for name in KINDS)}


def _pixels(case: Mapping[str, Any]) -> int:
    return (case.get("width") or 0) * (case.get("height") or 0)


def _terse(measured: MeasurementRecord, pixels: int) -> MeasurementRecord:
    left = measured.copy()
    if left.get("interior") == pixels - left.get("edge", 0):  # of the image's `pixels`
        del left["interior"]
    if left.get("worst_inside") == left.get("worst_ratio"):
        left.pop("worst_inside", None)
    for name in (*COUNTS, *NUMBERS):
        if left.get(name) == 0:
            del left[name]
    if left.get("pixel") == [0, 0]:
        del left["pixel"]
    return left


def _complete(measured: MeasurementRecord, pixels: int) -> None:
    measured.setdefault("interior", pixels - measured.get("edge", 0))
    for name in COUNTS:
        measured.setdefault(name, 0)
    for name in NUMBERS:
        measured.setdefault(name, 0.0)
    measured.setdefault("pixel", [0, 0])
    measured.setdefault("worst_inside", measured.get("worst_ratio"))


def _unlike(first: AdjudicationRecord, matrix: AdjudicationRecord) -> AdjudicationRecord:
    """Return a stage's matrix without what the first stage's says as well."""
    same = {name for name in SHARED if name in matrix and matrix[name] == first.get(name)}
    return cast("AdjudicationRecord", {name: value for name, value in matrix.items() if name not in same})


def _agreeing(matrix: AdjudicationRecord) -> AdjudicationRecord:
    """Return a stage's matrix without the numbers of differing pixels, where these are all 0, and by its upper half."""
    ratio, differing = matrix.get("ratio"), matrix.get("differing")
    if not ratio or not differing or any(count for row in differing for count in row):
        return matrix
    left = cast("AdjudicationRecord", {name: value for name, value in matrix.items() if name != "differing"})
    if all(ratio[row][column] == ratio[column][row] for row in range(len(ratio)) for column in range(row)):
        left["ratio"] = [row[place:] for place, row in enumerate(ratio)]
    return left


def _square(matrix: AdjudicationRecord) -> None:
    """Put back what `_agreeing` left out."""
    ratio: Any = matrix.get("ratio")
    if ratio and "differing" not in matrix:
        if len(ratio) > 1 and all(len(row) == len(ratio) - place for place, row in enumerate(ratio)):
            size = range(len(ratio))
            ratio = [[ratio[min(i, j)][max(i, j) - min(i, j)] for j in size] for i in size]
        matrix["ratio"] = ratio
        matrix["differing"] = [[None if value is None else 0 for value in row] for row in ratio]
