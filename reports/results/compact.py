"""results.json without repetition: `compact` removes values that checks share, and `expand` restores them.

Tens of thousands of checks share a few hundred derivations, most checks pass with every pixel within a strict limit,
and a third of a measurement is counts of 0. `publish/page/html/records.js` is `expand` for the page.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, cast

import msgspec

from rayproof.reports.results.case_records import (
    AdjudicationRecord,
    CaseRecord,
    Check,
    CheckGroupRecord,
    Measurement,
    RenderRecord,
    WrittenCaseRecord,
)
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

TABLE = "derivations"
MEASUREMENTS = ("end_to_end", "continued")
NUMBERS = ("worst_ratio", "worst_error", "limit", "ulp", "mean_wrong")  # of a measurement: omitted if 0
RENDERED = (("error", None), ("cached", False))  # usual values of a render, which are omitted
# Fields of a stage's matrix that are omitted if they equal those of the first stage.
SHARED: tuple[Literal["baseline", "renderers"], ...] = ("baseline", "renderers")


def compact(record: CaseRecord, places: dict[str, int]) -> WrittenCaseRecord:
    """Return a case's record in the format of results.json.

    Derivations become their numbers in `places`, to which new derivations are added.
    """
    written = cast("WrittenCaseRecord", dict(record))
    if "checks" in record:
        groups: dict[tuple[str, str], CheckGroupRecord] = {}
        because: dict[str, dict[str, int]] = {}
        for check in record["checks"]:
            of = check.configuration, check.reference
            group = groups.setdefault(of, {"configuration": of[0], "reference": of[1], "stages": {}})
            place = places.setdefault(str(check.because), len(places))
            usual = because.setdefault(check.reference, {}).setdefault(check.stage, place)
            own = None if place == usual else place
            group["stages"][check.stage] = cast("Check", _without_the_usual(check, _pixels(record), own))
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
    """Return a case's compact record with a table of derivations of its own; html/records.js is the inverse."""
    places: dict[str, int] = {}
    return {"checks": [], **compact(cast("CaseRecord", record), places), TABLE: list(places)}


def expand(results: RunRecord) -> None:
    """Restore, in place, the values that `compact` removed."""
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


def expand_case(record: Mapping[str, Any]) -> CaseRecord:
    """Undo `compact_case` in place and return the record."""
    case = cast("dict[str, Any]", record)
    expand(cast("RunRecord", {"cases": [case], TABLE: case.pop(TABLE, [])}))
    return cast("CaseRecord", case)


def _checks(case: CaseRecord, because: Mapping[str, Any], table: list[str]) -> Iterator[Check]:
    for group in cast("list[dict[str, Any]]", case["checks"]):
        of = {name: group[name] for name in ("configuration", "reference")}
        for stage, written in group["stages"].items():
            usual = because.get(of["reference"], {}).get(stage)
            check = {"verdict": Outcome.PASS.value, **({} if usual is None else {"because": usual}), **written}
            check |= {**of, "stage": stage}
            if (counts := check.get("examined", {})) is not None:
                check["examined"] = {"pixels": _pixels(case), **counts}
            place = check.get("because")
            if isinstance(place, int) and not isinstance(place, bool):
                check["because"] = str(table[place]) if 0 <= place < len(table) else ""
            for name in MEASUREMENTS:
                measured = check.get(name)
                if name == "continued" and measured == {} and check["end_to_end"]:
                    measured = check[name] = check["end_to_end"].copy()
                if measured is not None:
                    measured.setdefault("interior", _pixels(case))
            if "ratio" not in check and isinstance(whole := check.get("end_to_end"), dict):
                check["ratio"] = whole.get("worst_ratio") or 0.0
            yield msgspec.convert(check, Check, strict=False)  # inf and nan are strings in JSON


def _without_the_usual(check: Check, pixels: int, because: int | None) -> dict[str, Any]:
    """Return a check without the fields of its group and the values that `expand` restores.

    `because` is the number of the check's own derivation, if it differs from the usual derivation.
    """
    left: dict[str, Any] = msgspec.to_builtins(check)
    for name in ("configuration", "reference", "stage", "because"):
        left.pop(name, None)
    if because is not None:
        left["because"] = because
    if (whole := check.end_to_end) is not None:
        if repr(check.ratio) == repr(whole.worst_ratio):  # texts, so that NaN equals NaN
            del left["ratio"]
        # Not empty: `expand` replaces an empty `continued` with a copy of `end_to_end`.
        left["end_to_end"] = _terse(whole, pixels) or {"interior": whole.interior}
    if (own := check.continued) is not None:
        left["continued"] = {} if repr(own) == repr(whole) else _terse(own, pixels) or {"interior": own.interior}
    examined: dict[str, int] | None = left.setdefault("examined", None)
    if examined is not None and examined.get("pixels") == pixels:
        del examined["pixels"]
    if examined == {}:
        del left["examined"]
    return left


def _pixels(case: Mapping[str, Any]) -> int:
    return (case.get("width") or 0) * (case.get("height") or 0)


def _terse(measured: Measurement, pixels: int) -> dict[str, Any]:
    left: dict[str, Any] = msgspec.to_builtins(measured)
    if measured.interior == pixels:
        del left["interior"]
    for name in NUMBERS:
        if left.get(name) == 0:
            del left[name]
    if measured.pixel == (0, 0):
        left.pop("pixel", None)
    return left


def _unlike(first: AdjudicationRecord, matrix: AdjudicationRecord) -> AdjudicationRecord:
    """Return a stage's matrix without the fields that equal those of the first stage's matrix."""
    same = {name for name in SHARED if name in matrix and matrix[name] == first.get(name)}
    return cast("AdjudicationRecord", {name: value for name, value in matrix.items() if name not in same})


def _agreeing(matrix: AdjudicationRecord) -> AdjudicationRecord:
    """Return a stage's matrix; if no pixels differ, without their numbers and with only the upper half of ratios."""
    ratio, differing = matrix.get("ratio"), matrix.get("differing")
    if not ratio or not differing or any(count for row in differing for count in row):
        return matrix
    left = cast("AdjudicationRecord", {name: value for name, value in matrix.items() if name != "differing"})
    if all(ratio[row][column] == ratio[column][row] for row in range(len(ratio)) for column in range(row)):
        left["ratio"] = [row[place:] for place, row in enumerate(ratio)]
    return left


def _square(matrix: AdjudicationRecord) -> None:
    """Restore, in place, the values that `_agreeing` removed."""
    ratio: Any = matrix.get("ratio")
    if ratio and "differing" not in matrix:
        if len(ratio) > 1 and all(len(row) == len(ratio) - place for place, row in enumerate(ratio)):
            size = range(len(ratio))
            ratio = [[ratio[min(i, j)][max(i, j) - min(i, j)] for j in size] for i in size]
        matrix["ratio"] = ratio
        matrix["differing"] = [[None if value is None else 0 for value in row] for row in ratio]
