"""`python -m tests.benchmarks.bench`: our tracer and other renderers draw the same scenes in turns."""

import json as json_module
import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

from rayproof.reports.commands.lookup import Repeated, configurations
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from tests.command_line import call

if TYPE_CHECKING:
    from tests.benchmarks.bench.records import BenchRecord, SceneRecord

BUDGET, QUICK_BUDGET = 4.0, 0.8  # s for the rounds of one scene at one size


def bench(
    *scenes: str,
    quick: bool = False,
    compare: Path | None = None,
    out: Path | None = None,
    json: Path | None = None,
    formula: Repeated = (),
) -> int:
    """Time the tracer beside Mitsuba and Radiance, interleaved, with the errors beside the times.

    Each ratio is another renderer's time over ours, the median of ratios within rounds, with a 95 % interval; the
    control is our own time over our own. Both pictures are compared first. Compile and build times stand apart.
    A scene on which somebody dies is left out, and the exit code is 1. So is one whose data are not installed, with the
    reason, and the exit code is 0.

    Parameters
    ----------
    scenes
        Names of bench scenes. Default: all.
    quick
        The smaller scenes at 512 x 512, without the slow contenders.
    compare
        An earlier --json: say which scenes became slower or faster since.
    out
        A folder that gets the same as bench.json.
    json
        Also write everything to this file; an interrupted benchmark leaves there what it has.
    formula
        A formula for our tracer, such as sphere/textbook, or a function of one's own as sphere=./mine.py:nearest_hit.
        Its time is shown beside that of the default formulas. Repeatable.

    """
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.cases.benchmark_scenes import QUICK_SIZES, SIZES, chosen
    from tests.benchmarks.bench.apart import BenchError, Task, timed_apart
    from tests.benchmarks.bench.document import begun, everybody
    from tests.benchmarks.bench.limits import machine
    from tests.benchmarks.bench.records import compared

    with told_in_one_line():
        asked = chosen(scenes, quick=quick)
        by = configurations(("float32",), formula)[0].name
        old = _earlier(compare)
        if out is not None:
            own(out)
        if json is not None:
            writable_folder(json.parent)
    for one in asked:
        if (reason := one.missing()) is not None:
            say(f"{one.name} is left out: {reason}")
    files = [file for file in (json, out / "bench.json" if out is not None else None) if file is not None]

    names = everybody(quick=quick, formulas=bool(formula))
    document, failed = begun(machine()), False
    if formula:
        document["formulas"] = by
    budget, sizes = (QUICK_BUDGET, QUICK_SIZES) if quick else (BUDGET, SIZES)
    tasks = [
        Task(scene=one.name, size=size, contenders=names, machine=document["machine"], budget=budget, formulas=by)
        for one in asked
        if one.missing() is None
        for size in sizes
    ]
    for found in timed_apart(tasks):
        if isinstance(found, BenchError):
            say(f"error: {found}")
            failed = True
            continue
        document["scenes"].append(found)
        for file in files:
            write_json(file, document)
        say(line(found))
    if old is not None:
        document["changes"] = compared(old, document)
        for file in files:
            write_json(file, document)
    show_table("Times: theirs over ours", HEAD, [row(entry) for entry in document["scenes"]])
    for entry in document["scenes"]:
        if "default" in entry:
            told = _ratio(entry["default"], entry["default_interval"])
            say(f"{entry['name']} {entry['width']}x{entry['height']}: {told} is the default formulas' time over {by}'s")
    for change in document.get("changes", ()):
        low, high = change["interval"]
        said = f"{change['name']} {change['width']}x{change['height']}: {change['verdict']}"
        say(f"{said}, time x{change['change']:.3g} [{low:.3g}, {high:.3g}]")
    return 1 if failed else 0


HEAD = [
    "scene",
    "size",
    "ours [ms]",
    "minimal",
    "direct",
    "control",
    "differ",
    "error p99",
    "compile",
    "build",
    "of limit",
]


def line(entry: "SceneRecord") -> str:
    """Return a finished scene in a line."""
    return "  ".join(row(entry))


def row(entry: "SceneRecord") -> list[str]:
    """Return a scene's cells."""
    error, differ, limit = entry["error"], entry["pixels_differ"], entry["limit_fraction"]
    together = entry["limit_sum_fraction"]
    return [
        entry["name"],
        f"{entry['width']}x{entry['height']}",
        f"{entry['ours_ms']:.2f}",
        _ratio(entry["ratio_minimal"], entry["ratio_minimal_interval"]),
        _ratio(entry["ratio_direct"], entry["ratio_direct_interval"]),
        _ratio(entry["control"], entry["control_interval"]),
        "-" if differ is None else f"{100 * differ:.3f} %",
        "-" if error is None else f"{error['p99']:.1e}",
        f"{entry['compile_ms']:.0f} ms",
        f"{entry['build_ms']:.0f} ms",
        "-" if limit is None or together is None else f"{100 * limit:.0f} % (sum {100 * together:.0f} %)",
    ]


def _ratio(value: float | None, interval: list[float] | None) -> str:
    return "-" if value is None or interval is None else f"{value:.2f} [{interval[0]:.2f}, {interval[1]:.2f}]"


def _earlier(file: Path | None) -> "BenchRecord | None":
    """Return an earlier benchmark.

    Raises:
        UsageError: the file is none.

    """
    if file is None:
        return None
    try:
        document = json_module.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UsageError(f"{file}: is not JSON: {error}") from None
    if not isinstance(document, dict) or not isinstance(document.get("scenes"), list):
        raise UsageError(f"{file}: is not a benchmark that --json wrote")
    return cast("BenchRecord", document)


if __name__ == "__main__":
    sys.exit(call(bench))
