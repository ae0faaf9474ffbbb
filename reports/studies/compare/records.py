"""Records of `rayproof compare --json`, one class per level, and their tables."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NotRequired, TypedDict, final

import numpy as np

from rayproof.cases.scene import Scene, Shape, Sphere, Square
from rayproof.reports.results.provenance import Origin
from rayproof.reports.studies.compare.statistics import Interval
from rayproof.reports.studies.publication import COLORS, Draw, markdown_cell, markdown_table


class FamilyRecord(TypedDict):
    """The comparison in one family."""

    family: str
    stress: bool
    outcome: str
    changed: dict[str, int]  # the fields of `findings.Signs`
    scenes: int
    pixels: int
    same_inputs: bool
    digits_gained: float | None  # None for a stage that is only right or wrong
    digits_interval: Interval | None
    share_better: float
    share_worse: float
    wrong: dict[str, float]  # pixels: base, candidate, only_base, only_candidate; p of equal error rates
    tail: dict[str, float]  # the fields of `statistics.Tail`
    errors: dict[str, dict[str, dict[str, Any]]]  # by stage, of base and candidate: the fields of `findings.Errors`
    time_ratio: float
    time_interval: Interval
    nanoseconds_per_ray: tuple[float, float]  # of the base, of the candidate
    compile_seconds: tuple[float, float]


class SideRecord(TypedDict):
    """The results of the candidate, or of the control, against the base."""

    verdict: str
    outcome: str
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float
    time_interval: Interval
    families: list[FamilyRecord]
    families_outside: NotRequired[int]  # only of the control: the number of families whose time interval excludes 1


@final
class FormulaComparisonRecord(SideRecord):
    """The comparison of two formulas or configurations."""

    schema: int
    origin: Origin
    base: str
    candidate: str
    configurations: list[str]
    faults: list[str]  # planted ones in use
    stages: list[str]
    level: float  # of the intervals
    repetitions: int
    control: SideRecord  # the base against itself


class SweptRecord(TypedDict):
    """A parameter of a user's own formula, and its values in the sweep."""

    candidate: str  # without the value
    parameter: str
    values: list[float]


@final
class SweepRecord(TypedDict):
    """The comparisons of the base with the candidate, one per value of the swept parameter."""

    schema: int
    origin: Origin
    sweep: SweptRecord
    comparisons: list[FormulaComparisonRecord]


class CaseMove(TypedDict):
    """The change of a case between two runs."""

    case: str
    family: str
    before: str  # its verdict
    after: str
    digits_gained: float | None
    check: str  # the check that changed most
    seconds: list[float]  # run times of the tracer before and after


class FamilyMove(TypedDict):
    """The change of a family between two runs."""

    family: str
    digits_gained: float | None
    changed: int  # cases with another verdict


@final
class RunComparison(TypedDict):
    """The comparison of two finished runs."""

    schema: int
    origin: Origin
    base: str
    candidate: str
    configurations: list[list[str]]
    faults: list[str]
    verdict: str
    outcome: str
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float | None
    time_interval: Interval | None
    control: None
    families: list[FamilyMove]
    shared: int  # cases
    only_base: list[str]
    only_candidate: list[str]
    changed: list[CaseMove]


# A comparison as rows of a table, and as Markdown.


COLUMNS: dict[str, tuple[str, ...]] = {
    "formulas": (
        "family", "outcome", "digits gained", "wrong pixels", "p99 error / K u", "time ratio", "control", "ns/ray",
    ),
    "runs": ("case", "before", "after", "digits gained", "worst check"),
    "sweep": ("value", "outcome", "digits gained", "wrong pixels", "time ratio"),
}  # fmt: skip


# The columns that fit the width of an article's text.
FITS: dict[str, tuple[str, ...]] = {
    "formulas": ("family", "outcome", "digits gained", "wrong pixels", "time ratio"),
    "runs": ("case", "before", "after", "digits gained"),
    "sweep": COLUMNS["sweep"],
}


def kind_of(result: "Compared") -> str:
    """Return the key of `COLUMNS` for a result's table."""
    return "sweep" if "sweep" in result else "runs" if "changed" in result else "formulas"


def rows(result: "Compared") -> list[list[str]]:
    """Return the rows of the table of a comparison of formulas or of runs, or of a swept parameter."""
    if "sweep" in result:
        values = zip(result["sweep"]["values"], result["comparisons"], strict=True)
        return [[f"{value:.4g}", *_swept(record)] for value, record in values]
    if "changed" in result:
        return [
            [record["case"], record["before"], record["after"], _digits(record["digits_gained"], None), record["check"]]
            for record in result["changed"]
        ]
    controls = {record["family"]: record for record in result["control"]["families"]}
    return [_row(record, controls[record["family"]]) for record in result["families"]]


def _swept(compared: FormulaComparisonRecord) -> list[str]:
    before, after = (sum(family["wrong"][side] for family in compared["families"]) for side in ("base", "candidate"))
    return [
        compared["outcome"],
        _digits(compared["digits_gained"], compared["digits_interval"]),
        f"{before} -> {after} of {sum(family['pixels'] for family in compared['families'])}",
        f"{compared['time_ratio']:.3f} {interval(compared['time_interval'])}",
    ]


def _row(family: FamilyRecord, control: FamilyRecord) -> list[str]:
    wrong = family["wrong"]
    changed = f"{wrong['base']} -> {wrong['candidate']} of {family['pixels']}"
    tails = [
        " -> ".join(f"{side['scaled']['p99']:.3g}" for side in (pair["base"], pair["candidate"]) if side["scaled"])
        for pair in family["errors"].values()
    ]
    before, after = family["nanoseconds_per_ray"]
    return [
        family["family"],
        family["outcome"],
        _digits(family["digits_gained"], family["digits_interval"]),
        changed,
        ", ".join(tail for tail in tails if tail),
        f"{family['time_ratio']:.3f} {interval(family['time_interval'])}",
        interval(control["time_interval"]),
        f"{before:.2f} -> {after:.2f}",
    ]


def interval(pair: Interval) -> str:
    """Return "[low, high]"."""
    return f"[{pair[0]:.3f}, {pair[1]:.3f}]"


def _digits(value: float | None, bounds: Interval | None) -> str:
    if value is None:
        return "-"
    return f"{value:+.2f}" if bounds is None else f"{value:+.2f} [{bounds[0]:.2f}, {bounds[1]:.2f}]"


Compared = FormulaComparisonRecord | RunComparison | SweepRecord


def title(result: Compared) -> str:
    """Return the names of the compared formulas, configurations or runs."""
    if "sweep" not in result:
        return f"{result['base']} -> {result['candidate']}"
    base, swept = result["comparisons"][0]["base"], result["sweep"]
    return f"{base} -> {swept['candidate']}, {len(swept['values'])} values of {swept['parameter']}"


def markdown(result: Compared) -> str:
    """Return the comparison as Markdown."""
    lines = [f"# {markdown_cell(title(result))}", ""]
    if "sweep" not in result:
        lines += [markdown_cell(result["verdict"]), ""]
        if control := result.get("control"):
            lines += [f"Control: {markdown_cell(control['verdict'])}", ""]
        if result.get("faults"):
            lines.insert(0, f"**PLANTED FAULT IN USE: {', '.join(result['faults'])}**\n")
    return "\n".join([*lines, markdown_table(COLUMNS[kind_of(result)], rows(result))])


# A comparison as a figure: digits gained and time ratio per family, or digits gained and wrong pixels per value.


def comparison_panels(result: FormulaComparisonRecord | RunComparison) -> list[Draw]:
    """Return the panels of a comparison: one line per family, with the interval of each number."""
    families: list[Any] = list(result["families"])[::-1]
    names = [family["family"] for family in families]

    def panel(axes: Any, key: str, neutral: float, title: str) -> None:
        for place, family in enumerate(families):
            value, interval = (
                family.get(f"{key}_{'gained' if key == 'digits' else 'ratio'}"),
                family.get(f"{key}_interval"),
            )
            if value is not None:
                low, high = interval or (value, value)
                axes.errorbar(
                    [value], [place], xerr=[[max(0.0, value - low)], [max(0.0, high - value)]], fmt="o", color=COLORS[0]
                )
        axes.axvline(neutral, color="black", linewidth=0.6)
        axes.set_yticks(range(len(names)), names if key == "digits" else [""] * len(names))
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.set_xlabel(title)

    digits: Draw = lambda axes: panel(axes, "digits", 0.0, "digits gained (more is better)")  # noqa: E731
    times: Draw = lambda axes: panel(axes, "time", 1.0, "time ratio (less is better)")  # noqa: E731
    return [digits] if "changed" in result else [digits, times]


def sweep_panels(sweep: SweepRecord) -> list[Draw]:
    """Return the panels of a swept parameter: digits gained, and wrong pixels, one curve per family."""
    values, name = sweep["sweep"]["values"], sweep["sweep"]["parameter"]
    families = list(
        dict.fromkeys(row["family"] for comparison in sweep["comparisons"] for row in comparison["families"])
    )

    def panel(axes: Any, title: str, height: Callable[[Any], float | None]) -> None:
        for number, family in enumerate(families):
            points = [
                (value, y)
                for value, comparison in zip(values, sweep["comparisons"], strict=True)
                for row in comparison["families"]
                if row["family"] == family and (y := height(row)) is not None
            ]
            axes.plot(
                [x for x, _ in points], [y for _, y in points], "o-", color=COLORS[number % len(COLORS)], label=family
            )
        axes.set(xscale="log", xlabel=name, ylabel=title)

    def wrong(row: Any) -> float:
        return row["wrong"]["candidate"] / max(1, row["pixels"])

    return [
        lambda axes: panel(axes, "digits gained", lambda row: row["digits_gained"]),
        lambda axes: panel(axes, "share of wrong pixels", wrong),
    ]


# The scene as float32 receives it: every number is rounded once, so that truth and formula start from the same floats.


def single(values: Any) -> Any:
    """Return a number, or nested tuples of numbers, rounded to float32."""
    if isinstance(values, tuple):
        return tuple(single(value) for value in values)
    return float(np.float32(values))


def _shape(shape: Shape) -> Shape:
    # The tracer decides from the float64 matrix whether a square's sides are orthogonal; rounding would shear them all.
    if isinstance(shape, Square):
        return replace(shape, albedo=single(shape.albedo))
    rounded = replace(shape, albedo=single(shape.albedo), to_world=single(shape.to_world))
    if isinstance(rounded, Sphere):
        return replace(rounded, center=single(rounded.center), radius=single(rounded.radius))
    return rounded


def as_received(scene: Scene) -> Scene:
    """Return the scene with its numbers rounded to float32, so that they are exact in every precision.

    Otherwise a formula's error would include the rounding of the scene's numbers, such as 0.1 m.
    """
    camera = scene.camera
    fields = {name: single(getattr(camera, name)) for name in ("eye", "target", "up", "fovy", "near", "far")}
    lights = tuple(replace(light, position=single(light.position), flux=single(light.flux)) for light in scene.lights)
    return replace(scene, camera=replace(camera, **fields), shapes=tuple(map(_shape, scene.shapes)), lights=lights)
