"""The ledger of execution paths: declared, executed by the suite, and compared with something.

A cell that is empty is a hole: a path that no case meets, or that nothing compares. What this machine cannot run is
neither a pass nor a hole.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypedDict

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES
from rayproof.reports.results.files import number
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import backend
from rayproof.tracer.plan import plan
from rayproof.tracer.render import render
from tests.harness.paths.declared import FRAMES, NUMBERS, PATHS, STAGES, Rendering
from tests.harness.paths.routes import (
    CHOICE,
    NAMES,
    ONE_LOOP,
    PIPELINED,
    ROUTED,
    ROUTES,
    SIDE,
    WHOLE,
    Comparison,
    asked,
    by_tiles,
    compare,
    suiting,
)

JUDGED = "references", "each stage within its derived limit, end to end and given the stage before"


# "with" is a word of Python's.
ComparedPath = TypedDict("ComparedPath", {"with": str, "how": str, "worst": float | None})


class PathEntry(TypedDict):
    """A path's row of the ledger."""

    name: str
    declared: str
    executed: list[str]  # cases
    compared: list[ComparedPath]
    here: bool  # whether this machine can run it


class Ledger(TypedDict):
    """What `--json` writes."""

    paths: list[PathEntry]
    empty: list[str]  # path and cell
    comparisons: list[Comparison]


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
    """Yield path, case and route of every time that the suite and the chosen routes meet a path."""
    for case in cases:
        for name in ROUTED:
            routes = asked(CHOICE.get(case.name, ()), name)
            found = met_by_case(case.scene, Configuration(precision=name), routes)
            yield from ((path, case.name, route) for path, by in found.items() for route in by)


def comparisons(cases: Iterable[Case], *, everything: bool = False) -> Iterator[Comparison]:
    """Yield how the routes that are chosen for each case, or all that suit it, compare with its judged images."""
    for case in cases:
        routes = NAMES if everything else CHOICE.get(case.name, ())
        for name in ROUTED:
            configuration = Configuration(precision=name)
            suited = suiting(asked(routes, name), case.scene, configuration)
            if suited:
                answers = render(case.scene, IMAGE_STAGES, configuration)
                for route in suited:
                    found = compare(route, case.scene, configuration, answers)
                    found["case"] = case.name
                    yield found


def sentence(entry: Comparison) -> str:
    """Return in words where a route differs."""
    column, row = entry["pixel"] or (0, 0)
    return (
        f"{entry['configuration']} by {entry['path']}: {entry['stage']} differs from {entry['with']} in "
        f"{entry['differ']} pixels, most in ({column}, {row}); {entry['how']}"
    )


def ledger(cases: Sequence[Case], *, compared: Sequence[Comparison] = ()) -> Ledger:
    """Return the ledger of the paths, with the results of comparisons."""
    by_path: dict[str, dict[str, set[str]]] = {}
    for path, case, route in _executed(cases):
        by_path.setdefault(path, {}).setdefault(route, set()).add(case)
    worst: dict[tuple[str, str], float] = {}
    for one in compared:
        ratio = number(one["worst"])
        if ratio is not None:
            at = one["path"], one["case"]
            worst[at] = max(worst.get(at, 0.0), ratio)
    paths = [_entry(path.name, path.what, by_path.get(path.name, {}), worst) for path in PATHS]
    empty = [f"{entry['name']}: {cell}" for entry in paths for cell in _holes(entry)]
    return {"paths": paths, "empty": empty, "comparisons": list(compared)}


def _entry(name: str, what: str, met_by: Mapping[str, set[str]], worst: Mapping[tuple[str, str], float]) -> PathEntry:
    kind, _, which = name.partition("/")
    return {
        "name": name,
        "declared": what,
        "executed": sorted(set().union(*met_by.values())) if met_by else [],
        "compared": [_compared(route, met_by[route], worst) for route in ("", *ROUTES) if met_by.get(route)],
        "here": kind != "backend" or which == backend(),
    }


def _compared(route: str, cases: Collection[str], worst: Mapping[tuple[str, str], float]) -> ComparedPath:
    beside, how = JUDGED if route == "" else (ROUTES[route].beside, ROUTES[route].how)
    known = [worst[route, case] for case in cases if (route, case) in worst]
    return {"with": beside, "how": how, "worst": max(known, default=None)}


def _holes(entry: PathEntry) -> list[str]:
    cells = {"executed": entry["executed"], "compared": entry["compared"]}
    return [cell for cell, full in cells.items() if entry["here"] and not full]
