"""`rayproof stability`, `worst`, `limits`: formulas on ladders, their worst inputs, and renderers on ladders."""

import os
import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter
from msgspec.structs import asdict

from rayproof.reports.commands.lookup import sweep_of
from rayproof.reports.commands.output import console, say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.results.files import SCHEMA, several
from rayproof.reports.results.provenance import caption, keep, origin
from rayproof.reports.studies.publication import MOST_PANELS, Paper, chosen, draw, write_table

if TYPE_CHECKING:
    import numpy as np

    from rayproof.cases.ladders import Inputs
    from rayproof.reports.studies.stability.limit_records import LimitsRecord
    from rayproof.reports.studies.stability.records import ClimbRecord, SurveyRecord
    from rayproof.reports.studies.stability.worst import Worst
from rayproof.reports.studies.stability.survey import SurveyPlan

CLEARED = 100  # columns of an earlier, longer line
COLUMNS = (
    "ladder", "formula", "precision", "slope", "predicted", "breakpoint", "error / K u", "false hits", "false misses",
    "per million", "verdict", "expected",
)  # fmt: skip
FITS = ("ladder", "formula", "precision", "slope", "breakpoint", "error / K u", "verdict")  # of an article's text
WORST_COLUMNS = ("formula", "inputs of", "what", "limits", "inputs")
NAMED = 5  # worst inputs that are printed
SHOWN = 40  # rows of the table, unless formulas or ladders were named
Precisions = Annotated[tuple[Literal["float32", "float64"], ...], Parameter(negative="", show_default=False)]


def stability(
    *selectors: str,
    quick: bool = False,
    precision: Precisions = (),
    json: Path | None = None,
    out: Path | None = None,
    sweep: str | None = None,
    paper: Annotated[Paper, Parameter(name="*")] = Paper(),  # noqa: B008  frozen
) -> int:
    """Measure formulas on ladders of ill-conditioned inputs.

    For example: rayproof stability sphere "SPH-*" --precision float32

    Parameters
    ----------
    selectors
        Formulas: a slot such as sphere, a formula such as sphere/haines, a pattern, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Ladders: SPH-FAR, or a pattern such as "SPH-*". Default: all formulas on all
        ladders.
    quick
        Draw fewer rays.
    precision
        float32 or float64. Repeatable. Default: both.
    json
        Also write the results to this file.
    out
        Also write JSON, CSV and SVG of every ladder to OUT/stability, with the data needed to compute them again.
    sweep
        Measure your own function for many values of a parameter: eps=1e-6..1e-2:9 are nine values in equal ratios.

    """
    from rayproof.cases.ladders import all_ladders

    ladder_names = [word for word in selectors if any(fnmatchcase(ladder.name, word) for ladder in all_ladders())]
    formulas = [word for word in selectors if word not in ladder_names]
    writable(out, json, paper)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.stability.beside_default import (
        beside_columns,
        beside_rows,
        beside_title,
        defaults_of,
        own_alone,
    )
    from rayproof.reports.studies.stability.figures import most_different, paper_rows
    from rayproof.reports.studies.stability.survey import plan, survey

    name, patterns, values = swept(formulas, sweep)
    beside = sweep is None and own_alone(patterns)
    with told_in_one_line():
        named = [*patterns, *defaults_of(patterns)] if beside else patterns
        planned = plan(named, ladders=ladder_names, precisions=precision or ("float32", "float64"), quick=quick)
        columns = beside_columns(patterns, planned.precisions) if beside else COLUMNS
        chosen(paper, columns)
    if not planned.ladders:
        raise UsageError("none of these formulas is measured on any of these ladders")
    doubts: list[str] = []
    records: list[ClimbRecord] = []
    for record in survey(planned, doubts=doubts.append):
        records.append(record)
        tell(len(records), planned.climbs, record)
    surprises = sum(bool(record.surprise) for record in records) + len(doubts)
    survey_record = summary(planned, records, doubts, surprises)
    write_json(json, survey_record)
    if out is not None:
        written(out / "stability", planned, survey_record)
        keep(out, "stability", survey_record.origin["seed"])
    rows = beside_rows(records, planned.precisions) if beside else [row(record) for record in records]
    if beside:
        show_table(beside_title(patterns), columns, rows)
        tell_the_rest(records, doubts, surprises)
    else:
        show(records, doubts, surprises, everything=bool(formulas or ladder_names))
    ladders = [ladder for ladder, _ in planned.ladders]
    if paper.figure is not None and len(ladders) > MOST_PANELS:
        say(f"--figure shows the {MOST_PANELS} of {len(ladders)} ladders on which the formulas differ most")
        ladders = most_different(ladders, records, MOST_PANELS)
    about = f"{', '.join(ladder.name for ladder in ladders[:MOST_PANELS])}. {caption(survey_record.origin)}."
    title = f"{beside_title(patterns)}. " if beside else ""
    write_table(paper, columns, rows, caption=f"{title}{about}", fits=() if beside else FITS)
    drawn = paper_rows(ladders, records, (name, values) if name else None) if paper.figure is not None else []
    draw(paper, drawn, caption=about, height=0.38 * paper.width)
    return 1 if surprises else 0


def writable(out: Path | None, json: Path | None, paper: Paper) -> None:
    """Raise UsageError if the files and folders of a study cannot be written, before anything is measured."""
    with told_in_one_line():
        paper.check()
        if out is not None:
            own(out / "stability")
        if json is not None:
            writable_folder(json.parent)


def worst_inputs(
    *formulas: str,
    precision: Literal["float32", "float64"] = "float32",
    seconds: float = 60.0,
    seed: int = 1,
    keep_rays: Annotated[Path | None, Parameter(name="--keep")] = None,
    json: Path | None = None,
    out: Path | None = None,
    table: Path | None = None,
    columns: str | None = None,
) -> int:
    """Search for the inputs with each formula's largest errors; exit with 1 if an error is beyond its limit.

    For example: rayproof worst sphere=./mine.py:nearest_hit --keep worst.csv

    Parameters
    ----------
    formulas
        Formulas such as sphere/haines, or functions of your own, such as sphere=./mine.py:nearest_hit.
    precision
        float32 or float64.
    seconds
        The time [s] for which each formula is searched.
    seed
        The seed of the search.
    keep_rays
        Write the worst inputs into this CSV file, as test vectors.
    json
        Also write the results to this file.
    out
        Also write the results to OUT/stability, which the report shows.
    table
        Also write the table into this file, ending in .tex, .csv or .md.
    columns
        Columns of the table by their headings, separated by commas, in this order. Default: all.

    """
    if not formulas:
        raise UsageError("name formulas: sphere/haines, or a function of your own, sphere=./mine.py:hit")
    if not seconds > 0:
        raise UsageError(f"--seconds must be positive, got {seconds}")
    paper = Paper(table=table, columns=columns)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.stability.worst import breeds_of, common, search
    from rayproof.reports.vectors.files import ORDER, as_csv
    from rayproof.reports.vectors.files import columns as vector_columns
    from rayproof.reports.vectors.rows import LADDERS
    from rayproof.tracer.formulas import FORMULAS

    with told_in_one_line():
        chosen(paper, WORST_COLUMNS)
        if keep_rays is not None:
            writable_folder(keep_rays.parent)
        searched = [FORMULAS.named(name) for name in formulas]
        bred = [(formula, breeds_of(formula, precision, seed)) for formula in searched]
    writable(out, json, paper)
    if keep_rays is not None:
        if len({formula.slot for formula in searched}) > 1:
            raise UsageError("--keep writes the vectors of one slot: name formulas of one slot")
        if precision != "float32" or any(breed.ladder not in LADDERS for _, breeds in bred for breed in breeds):
            raise UsageError("--keep writes vectors, which are float32 rays and lights: this search finds none")
    kept = Vectors()
    searches: list[dict[str, Any]] = []  # by formula and ladder
    for formula, breeds in bred:
        for breed in breeds:
            with console().status("searching") as status:
                worst = search(breed, seconds=seconds / len(breeds), seed=seed, tell=status.update)
            beyond = int((worst.scores > 1).sum())
            of = "" if len(breeds) == 1 else f" of {breed.ladder.name}"
            alike, most, tried = common(worst), len(worst.scores), several(worst.tried, "input")
            say(f"{formula.name}: {tried}{of} tried, {beyond} of the worst {most} beyond their limit")
            say(f"  the worst {most}: {'; '.join(alike)}")
            if tied := len(next(iter(worst.ties.values()), ())):
                first = _inputs(worst.ties, 0)
                say(f"  {tied} or more exact ties, such as those in a face or on an edge, are decided wrongly: {first}")
            if keep_rays is not None:
                kept.add(formula.name, worst, tied)
            rows = [
                [formula.name, breed.ladder.name, worst.kinds[number], f"{score:.3g}", _inputs(worst.inputs, number)]
                for number, score in enumerate(worst.scores[:NAMED])
            ]
            searches.append({
                "formula": formula.name, "ladder": breed.ladder.name, "tried": worst.tried, "beyond": beyond,
                "scores": worst.scores.tolist(), "common": alike, "worst": rows,
            })  # fmt: skip
    shown = sorted(
        (row for search_record in searches for row in search_record["worst"]), key=lambda row: -float(row[3])
    )
    show_table("The worst inputs", WORST_COLUMNS, shown[: NAMED * len(searched)])
    if keep_rays is not None:
        keep_rays.write_text(as_csv(vector_columns(kept.cells, ORDER), kept.cells), encoding="utf-8")
        say(f"{several(len(kept.cells), 'vector')} in {keep_rays}")
    made = origin(seed)
    content = {
        "schema": SCHEMA,
        "origin": made,
        "seconds": seconds,
        "precision": precision,
        "formulas": searches,
    }
    write_json(json, content)
    if out is not None:
        write_json(out / "stability" / "worst.json", content)
    write_table(paper, WORST_COLUMNS, shown, caption=f"The worst inputs. {caption(made)}.")
    return 1 if any(search_record["beyond"] for search_record in searches) else 0


class Vectors:
    """The worst inputs as test vectors."""

    def __init__(self) -> None:
        self.cells: list[dict[str, str | float]] = []

    def add(self, formula: str, worst: "Worst", tied: int) -> None:
        """Add the worst inputs of a search, and `tied` exact ties."""
        from rayproof.reports.vectors.check import VERSION
        from rayproof.reports.vectors.files import cells
        from rayproof.reports.vectors.rows import of_rays

        pairs = zip(worst.kinds, worst.scores, strict=True)
        whys = [f"{formula}: {kind} of {score:.3g} limits." for kind, score in pairs]
        rows = of_rays(worst.ladder, worst.inputs, whys)
        rows += of_rays(worst.ladder, worst.ties, [f"{formula}: an exact tie."] * tied)
        first = len(self.cells)
        self.cells += [cells(f"{VERSION}-{row.file}-worst-{first + k}", row) for k, row in enumerate(rows)]


def _inputs(inputs: "Inputs", number: int) -> str:
    """Return the input with the given number as text, each value with enough digits to read it back exactly."""
    return "  ".join(f"{name} {_exact(array[number])}" for name, array in inputs.items())


def _exact(numbers: "np.ndarray") -> str:
    single = (numbers == numbers.astype("f4")).all()
    return " ".join(f"{value:.9g}" if single else f"{value:.17g}" for value in numbers.ravel())


def swept(formulas: Sequence[str], sweep: str | None) -> tuple[str, list[str], dict[str, float]]:
    """Return the swept parameter, the formulas to measure, and the parameter's value per formula name.

    Each of the user's own formulas is replaced by one formula per value of the parameter.

    Without a sweep: no parameter, and the given formulas.
    """
    if sweep is None:
        return "", list(formulas), {}
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import is_own, with_number

    name, values = sweep_of(sweep)
    own = [formula for formula in formulas if is_own(formula)]
    if not own:
        raise UsageError("--sweep needs a formula of your own, slot=FILE.py:function")
    with told_in_one_line():
        values_by_text = {with_number(formula, name, value): value for formula in own for value in values}
        values_by_formula = {FORMULAS.named(text).name: value for text, value in values_by_text.items()}
    return name, [*(formula for formula in formulas if formula not in own), *values_by_text], values_by_formula


def limits(
    *ladders: str,
    subject: str = "tracer",
    quick: bool = False,
    against: Path | None = None,
    json: Path | None = None,
    out: Path | None = None,
    table: Path | None = None,
    columns: str | None = None,
) -> int:
    """Measure up to which step a whole renderer is right, on ladders of ever harder scenes.

    For example: rayproof limits offset tall --subject "exec:./mine {scene} {output}"

    Parameters
    ----------
    ladders
        Ladders of scenes, such as offset, or patterns. Default: all.
    subject
        The renderer: tracer, a reference, or "exec:COMMAND {scene} {output}".
    quick
        Leave out the other renderers' limits.
    against
        The file or folder of earlier limits. The exit code is 1 if any of them is lower now.
    json
        Also write the limits to this file.
    out
        Also write the limits to OUT/stability, which the report shows.
    table
        Also write the table into this file, ending in .tex, .csv or .md.
    columns
        Columns of the table by their headings, separated by commas, in this order. Default: all.

    """
    paper = Paper(table=table, columns=columns)
    writable(out, json, paper)
    from rayproof.reports.studies.stability.limit_records import load_limits
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    with told_in_one_line():
        earlier = None if against is None else load_limits(against)  # read now, since it may lie in OUT
    return limits_shown(whole_renderer(subject, ladders, json, out, alone=quick), earlier, paper)


def whole_renderer(
    subject: str, names: Sequence[str], json: Path | None, out: Path | None, *, alone: bool
) -> "LimitsRecord":
    """Measure a renderer on the scene ladders, without the other renderers if `alone`, and write the named files."""
    from rayproof.reports.commands.lookup import subject_named
    from rayproof.reports.processes.scratch import scratch
    from rayproof.reports.run.renderer_limits import columns, ladders_named, measure, scale
    from rayproof.reports.run.scenes import USUAL_LIMIT
    from rayproof.reports.studies.stability.limit_records import LimitsRecord, write_limits
    from rayproof.tracer.kernel.arrays import versions

    with told_in_one_line():
        ladders = ladders_named(names)
    with scratch():
        tested = subject_named(subject)
        renderers = columns(tested, alone=alone)
        record = LimitsRecord(
            schema=SCHEMA,
            subject=tested.title,
            renderers=[column.title for column in renderers],
            ladders=[scale(ladder) for ladder in ladders],
            limits=list(measure(renderers, ladders, jobs=os.cpu_count() or 1, seconds=USUAL_LIMIT)),
            environment=versions(),
        )
    write_json(json, record)
    if out is not None:
        write_limits(out / "stability", record)
    return record


def limits_shown(record: "LimitsRecord", earlier: "LimitsRecord | None", paper: Paper) -> int:
    """Print the limits of all renderers, compare the first with its earlier limits, and return the exit code."""
    from rayproof.reports.studies.stability.limit_records import changes, table, worse

    columns, rows = table(record)
    show_table(f"{record.renderers[0]}: right up to", columns, rows)
    if any(not limit.monotone for limit in record.limits):
        say("*: later rungs pass again; the ladder was climbed whole")
    with told_in_one_line():
        write_table(paper, columns, rows, caption=f"Up to where renderers are right. {caption(origin())}.")
    if earlier is not None:
        with told_in_one_line():
            compared = changes(earlier, record)
        lower = worse(compared)
        for sentence in lower:
            say(f"LOWER: {sentence}")
        say(f"{len(lower)} of {len(compared)} limits are lower than they were")
        return 1 if lower else 0
    firsts = {limit.verdict: limit for limit in record.limits[: len(record.ladders)] if limit.limit is None}
    broken = firsts.get("error") or firsts.get("missing")
    if broken is not None:
        say(f"{broken.ladder} {broken.verdict}: {broken.reason}")
    return 1 if "fail" in firsts else 0 if broken is None else 3


def tell(done: int, total: int, record: "ClimbRecord") -> None:
    """Print the survey's progress on standard error; only surprises if that is no terminal."""
    line = f"[{done}/{total}] {record.ladder} {record.formula} {record.precision}"
    if record.surprise:
        sys.stderr.write(f"\r{line}: SURPRISE: {record.surprise}\n")
    elif sys.stderr.isatty():
        sys.stderr.write(f"\r{line:<{CLEARED}}" + ("\n" if done == total else ""))
        sys.stderr.flush()


def summary(planned: "SurveyPlan", records: list["ClimbRecord"], doubts: list[str], surprises: int) -> "SurveyRecord":
    """Return the record that `--json` writes."""
    from rayproof.reports.studies.stability.device import keeps_subnormals
    from rayproof.reports.studies.stability.records import SurveyRecord
    from rayproof.tracer.kernel.arrays import versions

    return SurveyRecord(
        schema=SCHEMA,
        ladders=records,
        surprises=surprises,
        doubts=doubts,
        quick=planned.quick,
        origin=origin(", ".join(f"{ladder.name} {ladder.seed}" for ladder, _ in planned.ladders[:MOST_PANELS])),
        environment=versions(),
        subnormals={
            precision: "kept" if keeps_subnormals(precision) else "flushed to zero" for precision in planned.precisions
        },
    )


def written(folder: Path, planned: "SurveyPlan", record: "SurveyRecord") -> None:
    """Write the files of each ladder, the list of ladders and their common data, from which the report is made."""
    from rayproof.reports.studies.stability.figures import publish

    for ladder, _ in planned.ladders:
        publish(folder, ladder, [climb for climb in record.ladders if climb.ladder == ladder.name])
    write_json(folder / "ladders.json", [ladder.name for ladder, _ in planned.ladders])
    write_json(folder / "about.json", {key: value for key, value in asdict(record).items() if key != "ladders"})


def show(records: list["ClimbRecord"], doubts: list[str], surprises: int, *, everything: bool) -> None:
    """Print the table, worst first, then the surprises."""
    from rayproof.reports.studies.stability.survey import worst_first

    ordered = worst_first(records)
    kept = ordered if everything else ordered[:SHOWN]
    show_table(f"{len(records)} climbs, worst first", COLUMNS, [row(record) for record in kept])
    if len(kept) < len(ordered):
        say(f"and {len(ordered) - len(kept)} more that did no worse; --json or --out holds all")
    tell_the_rest(ordered, doubts, surprises)


def tell_the_rest(records: list["ClimbRecord"], doubts: list[str], surprises: int) -> None:
    """Print the surprises, the doubts about the truth, and the number of measurements."""
    for record in records:
        if record.surprise:
            say(f"SURPRISE: {record.ladder} {record.formula} {record.precision}: {record.surprise}")
    for doubt in doubts:
        say(f"DOUBT: {doubt}")
    expected = sum(record.expected == "fail" for record in records)
    counts = {"ladder": len({record.ladder for record in records}), "climb": len(records)}
    counts |= {"known failure": expected, "surprise": surprises}
    say(", ".join(several(count, noun) for noun, count in counts.items()))


def row(record: "ClimbRecord") -> list[str]:
    """Return the table row of a measured ladder."""
    slope = "" if record.slope is None else f"{record.slope:.2f}"
    if record.slope_interval:
        slope += " [{:.2f}, {:.2f}]".format(*record.slope_interval)
    counts = ", ".join(f"{name.replace('_', ' ')} {count:.0f}" for name, count in record.per_million.items())
    return [
        record.ladder,
        record.formula,
        record.precision,
        slope,
        short(record.slope_predicted),
        short(record.breakpoint) or "never right",
        short(record.scaled_error),
        str(record.false_hits),
        str(record.false_misses),
        counts,
        record.verdict,
        record.expected,
    ]


def short(value: float | None) -> str:
    """Return a table cell with three digits; empty for None."""
    return "" if value is None else f"{value:.3g}"
