"""The ledger of execution paths: declared, executed by the suite, compared with something, and shown to matter.

A cell that is empty is a hole: a path that no case meets, that nothing compares, or whose planted fault survived. What
this machine cannot run, and what the kept record of the audit says of other code, is not measured: neither a pass nor
a hole.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path as File
from typing import Any, TypedDict

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.reports.cache.digests import code
from rayproof.reports.paths.choice import CHOICE, ROUTED, asked
from rayproof.reports.paths.routes import ONE_LOOP, PIPELINED, ROUTES, SIDE, WHOLE, by_tiles, suiting
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.json_numbers import number
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.device.arrays import backend
from rayproof.tracer.paths import FRAMES, NUMBERS, PATHS, STAGES, Rendering
from rayproof.tracer.plan import plan

Faults = Mapping[str, Sequence[str]]  # path -> the planted faults in it alone

RECORD = File(__file__).with_name("record.json")
CODE = (
    "rayproof.tracer.render",
    "rayproof.tracer.frames",
    "rayproof.tracer.paths",
)  # of which the record speaks, with all that they import
JUDGED = "references", "each stage within its derived limit, end to end and given the stage before"
ELSEWHERE = "this machine has no such backend"


class AuditedFault(TypedDict):
    """What is read of a fault's entry of audit.json."""

    name: str
    killed: bool
    blamed_right: bool
    blamed_stage: str | None
    killed_by: list[str]


class KilledFault(TypedDict):
    """What is kept of a planted fault: whether it was killed, at which stage, and by which case."""

    killed: bool
    stage: str | None
    by: str | None


class Kept(TypedDict):
    """What is kept of an audit and a run."""

    digest: str  # of the code that they speak of
    faults: dict[str, KilledFault]
    worst: dict[str, dict[str, float]]  # route -> case -> the largest error over its limit
    current: bool  # whether this is that code


# "with" is a word of Python's.
ComparedPath = TypedDict("ComparedPath", {"with": str, "how": str, "worst": float | None})


class PathEntry(TypedDict):
    """A path's row of the ledger."""

    name: str
    declared: str
    executed: list[str]  # cases
    compared: list[ComparedPath]
    faults: Sequence[str]
    killed: list[str]
    measured: bool
    why: str | None  # why it is not measured


class Ledger(TypedDict):
    """What `--json` writes."""

    paths: list[PathEntry]
    empty: list[str]  # path and cell


def renderings(route: str, scene: Scene, configuration: Configuration) -> Rendering:
    """Return what a route renders of a scene."""
    usual = plan(scene, configuration)
    about = Rendering(scene=scene, configuration=configuration, plan=usual, route=STAGES)
    if route == "numbers":
        return replace(about, route=NUMBERS)
    if route == "frames":
        return replace(about, route=FRAMES)
    if route == "frames of tiles":
        return replace(about, route=FRAMES, plan=by_tiles(usual))
    if route == WHOLE:
        return replace(about, plan=replace(usual, parts=False))
    if route == ONE_LOOP:
        return replace(about, plan=replace(usual, **PIPELINED))
    several = plan(scene, configuration, samples=SIDE)
    if route == "samples":
        return replace(about, route=NUMBERS, samples=SIDE, plan=several)
    if route == "frames of samples":
        return replace(about, route=FRAMES, samples=SIDE, plan=replace(several, split=False))
    columns, rows = (int(word) for word in route.split() if word.isdigit())
    return replace(about, plan=replace(usual, columns=columns, rows=rows, split=False))


def met(rendering: Rendering) -> tuple[str, ...]:
    """Return the names of the paths that a rendering takes."""
    return tuple(path.name for path in PATHS if path.met(rendering))


def met_by_case(scene: Scene, configuration: Configuration, routes: Sequence[str]) -> dict[str, list[str]]:
    """Return path -> by which routes one configuration meets it; the judged one is called ''."""
    found: dict[str, list[str]] = {}
    judged = Rendering(scene=scene, configuration=configuration, plan=plan(scene, configuration), route=STAGES)
    for name in met(judged):
        found.setdefault(name, []).append("")
    for route in suiting(routes, scene, configuration):
        for name in met(renderings(route, scene, configuration)):
            found.setdefault(name, []).append(route)
    return found


def _executed(cases: Sequence[Case]) -> Iterator[tuple[str, str, str]]:
    """Yield path, case and route of every time that the default run of the suite meets a path."""
    for case in cases:
        for name in ROUTED:
            routes = asked(CHOICE.get(case.name, ()), name)
            found = met_by_case(case.scene, Configuration(precision=name), routes)
            yield from ((path, case.name, route) for path, by in found.items() for route in by)


def kept() -> Kept:
    """Return what is kept of an audit and a run, and in `current` whether it speaks of this code."""
    record: Any = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.is_file() else {"digest": ""}
    return {"faults": {}, "worst": {}} | record | {"current": record["digest"] == code(CODE)}


def keep(document: Mapping[str, Any], planted: Faults) -> str:
    """Keep what an audit says of the faults planted in paths, or a run of its comparisons; return of what, in words.

    What is kept of others stays. Of other code nothing stays.

    Raises:
        ValueError: it speaks of neither.

    """
    before = kept()
    faults, worst = (before["faults"], before["worst"]) if before["current"] else ({}, {})
    if "cases" in document:
        routes = {route: {**worst.get(route, {}), **cases} for route, cases in _worst(document["cases"]).items()}
        worst = {**worst, **routes}
        count, said = len(routes), f"{sum(map(len, routes.values()))} comparisons"
    else:
        killed = _killed(document["faults"], {name for some in planted.values() for name in some})
        faults = dict(sorted({**faults, **killed}.items()))
        count, said = len(killed), f"{len(killed)} faults"
    if not count:
        raise ValueError(
            "it says nothing of paths; run: python -m tests.harness.audit --only 'path/*', or rayproof run"
        )
    record = {"digest": code(CODE), "backend": backend(), "faults": faults, "worst": worst}
    write_text(RECORD, json.dumps(record, indent=1) + "\n")
    return said


def _killed(faults: Iterable[AuditedFault], named: Collection[str]) -> dict[str, KilledFault]:
    return {
        entry["name"]: {
            "killed": entry["killed"] and entry["blamed_right"],
            "stage": entry["blamed_stage"],
            "by": entry["killed_by"][0].split(":")[0] if entry["killed_by"] else None,
        }
        for entry in faults
        if entry["name"] in named
    }


def _worst(cases: Iterable[CaseRecord]) -> dict[str, dict[str, float]]:
    """Return route -> case -> the largest error over its limit that a run found; '' is the judged route.

    Cases that did not pass speak of no path: somebody has to look at them.
    """
    found: dict[str, dict[str, float]] = {}
    for case in cases:
        if case["verdict"] != Outcome.PASS:
            continue
        judged = (check.get("ratio") for check in case["checks"] if check.get("configuration") in ROUTED)
        compared = [("", ratio) for ratio in judged]
        compared += [(entry["path"], entry["worst"]) for entry in case.get("consistency", ())]
        for route, value in compared:
            ratio = number(value)
            if ratio is not None:
                mine = found.setdefault(route, {})
                mine[case["name"]] = max(mine.get(case["name"], 0.0), float(f"{ratio:.3g}"))
    return dict(sorted(found.items()))


def ledger(cases: Sequence[Case], planted: Faults) -> Ledger:
    """Return `paths` and `empty` as `--json` has them, with the faults that are planted in paths."""
    by_path: dict[str, dict[str, set[str]]] = {}
    for path, case, route in _executed(cases):
        by_path.setdefault(path, {}).setdefault(route, set()).add(case)
    record = kept()
    paths = [_entry(path.name, path.what, by_path.get(path.name, {}), planted, record) for path in PATHS]
    empty = [f"{entry['name']}: {cell}" for entry in paths for cell in _holes(entry)]
    unknown = sorted(set(planted) - {path.name for path in PATHS})
    return {"paths": paths, "empty": [*empty, *(f"{name}: not declared" for name in unknown)]}


def _entry(name: str, what: str, met_by: Mapping[str, set[str]], faults: Faults, record: Kept) -> PathEntry:
    kind, _, which = name.partition("/")
    here = kind != "backend" or which == backend()
    executed = sorted(set().union(*met_by.values())) if met_by else []
    compared = [_compared(route, met_by[route], record) for route in ("", *ROUTES) if met_by.get(route)]
    # Whatever was killed was killed on this backend.
    own = sorted(record["faults"]) if kind == "backend" else faults.get(name, [])
    said = {fault: record["faults"][fault] for fault in own if fault in record["faults"]}
    measured = here and record["current"] and bool(said)
    return {
        "name": name,
        "declared": what,
        "executed": executed,
        "compared": compared,
        "faults": own,
        "killed": [fault for fault, one in said.items() if one["killed"]] if measured else [],
        "measured": measured,
        "why": None if measured else ELSEWHERE if not here else "the kept audit is of other code" if own else None,
    }


def _compared(route: str, cases: Collection[str], record: Kept) -> ComparedPath:
    beside, how = JUDGED if route == "" else (ROUTES[route].beside, ROUTES[route].how)
    return {"with": beside, "how": how, "worst": _most(record, route, cases)}


def _most(record: Kept, route: str, cases: Collection[str]) -> float | None:
    """Return the largest error over its limit that the kept run found in some cases by a route, None of other code."""
    known = record["worst"].get(route, {}) if record["current"] else {}
    return max((known[case] for case in cases if case in known), default=None)


def _holes(entry: PathEntry) -> Iterator[str]:
    if entry["why"] == ELSEWHERE:
        return
    for cell, full in (
        ("executed", entry["executed"]),
        ("compared", entry["compared"]),
        ("shown to matter", entry["faults"] if not entry["measured"] else set(entry["killed"]) >= set(entry["faults"])),
    ):
        if not full:
            yield cell
