"""`rayproof compare`: errors and run times of two formulas, configurations or runs on the same rays."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rayproof.reports.commands.lookup import scene_files, sweep_of
from rayproof.reports.commands.output import console, say, shout, show_table, write_json
from rayproof.reports.commands.usage import UsageError, one_line, own, told_in_one_line, writable_folder
from rayproof.reports.studies.publication import Paper

if TYPE_CHECKING:  # otherwise every command would load this module
    from rayproof.reports.studies.compare.records import Compared, FormulaComparisonRecord, SweepRecord, SweptRecord

REPETITIONS = 31  # odd, so that the median is a measured time


def compare(
    base: str,
    candidate: str,
    *selectors: str,
    json: Path | None = None,
    out: Path | None = None,
    repetitions: int = REPETITIONS,
    precision: str = "float32",
    sweep: str | None = None,
    paper: Annotated[Paper, Parameter(name="*")] = Paper(),  # noqa: B008  frozen
) -> int:
    """Compare two formulas, configurations or finished runs.

    Parameters
    ----------
    base
        A formula such as sphere/haines, a function of your own, such as sphere=./mine.py:nearest_hit, a configuration
        such as float32/triangle=woop, or the folder of a finished run.
    candidate
        The formula, configuration or run to compare with the base, named in the same way.
    selectors
        Families, cases, stresses or scene files. Default: the cases that use the formula in which the two differ.
    json
        Also write the comparison to this file.
    out
        Also write comparison.json and comparison.md to this folder, with all inputs needed to compute them again.
    repetitions
        The number of times that each is timed on each family, at least 9; an even number is raised by one.
    precision
        The precision in which formulas run.
    sweep
        Compare with the candidate, a function of your own, for many values of a parameter of that function. For
        example, eps=1e-6..1e-2:9 gives nine values of eps in equal ratios.

    """
    from rayproof.reports.studies.compare import records
    from rayproof.reports.studies.compare.statistics import FEWEST, too_few
    from rayproof.reports.studies.publication import chosen, draw, write_table

    if repetitions < FEWEST:
        raise UsageError(f"--repetitions: {too_few(repetitions)}")
    kind = "runs" if is_folder(base) else "formulas" if sweep is None else "sweep"
    with told_in_one_line():
        paper.check()
        chosen(paper, records.COLUMNS[kind])
        if out is not None:
            own(out)
        if json is not None:
            writable_folder(json.parent)
    runs = [Path(name) for name in (base, candidate) if is_folder(name)]
    if len(runs) == 1:
        raise UsageError(f"{runs[0]} is a run; it can only be compared with another run")
    result: Compared
    if runs:
        if selectors or sweep:
            raise UsageError("selectors and --sweep do not apply to two finished runs")
        from rayproof.reports.history.run_difference import compare_runs

        with told_in_one_line():
            result = compare_runs(runs[0], runs[1])
    elif sweep is None:
        result = formulas(base, candidate, selectors, repetitions | 1, precision)
    else:
        result = swept(base, candidate, selectors, repetitions | 1, precision, sweep)
    from rayproof.reports.results.provenance import caption, keep

    columns, table, title = records.COLUMNS[records.kind_of(result)], records.rows(result), records.title(result)
    show(result, title, columns, table)
    write_json(json, result)
    about = f"{title}. {caption(result['origin'])}."
    write_table(paper, columns, table, caption=about, fits=records.FITS[records.kind_of(result)])
    if "sweep" in result:
        draw(paper, [records.sweep_panels(result)], caption=about, height=0.4 * paper.width)
    else:
        height = (len(result["families"]) + 4) * 0.7 * paper.font_size
        draw(paper, [records.comparison_panels(result)], caption=about, height=height)
    if out is not None:
        write_json(out / "comparison.json", result)
        (out / "comparison.md").write_text(records.markdown(result), encoding="utf-8")
        keep(out, "compare", result["origin"]["seed"])
    return 0


def is_folder(name: str) -> bool:
    """Return whether a name is an existing folder, that of a run; raise UsageError if it cannot be looked up."""
    with told_in_one_line():
        return Path(name).is_dir()


def swept(
    base: str, candidate: str, selectors: Sequence[str], repetitions: int, precision: str, sweep: str
) -> "SweepRecord":
    """Return the comparisons of the base with the candidate, one for each value of the swept parameter."""
    from rayproof.reports.results.files import SCHEMA
    from rayproof.tracer.formulas.own_file import is_own, with_number

    name, values = sweep_of(sweep)
    if "=" not in candidate or not is_own(candidate):
        raise UsageError(f"--sweep needs a candidate of your own, slot=FILE.py:function, got {candidate}")
    with told_in_one_line():
        candidates = [with_number(candidate, name, value) for value in values]
    comparisons = [formulas(base, variant, selectors, repetitions, precision) for variant in candidates]
    swept: SweptRecord = {"candidate": candidate, "parameter": name, "values": values}
    return {"schema": SCHEMA, "origin": comparisons[0]["origin"], "sweep": swept, "comparisons": comparisons}


def formulas(
    base: str, candidate: str, selectors: Sequence[str], repetitions: int, precision: str
) -> "FormulaComparisonRecord":
    """Return the comparison of two formulas or configurations."""
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.compare.comparison import compare as run_comparison
    from rayproof.reports.studies.compare.contenders import contender, questions, seen
    from rayproof.tracer.formulas.own_file import OwnFormulaError

    patterns, files = scene_files(selectors)
    with told_in_one_line():
        pair = seen(*(contender(name, precision=precision) for name in (base, candidate)))
        families = questions(patterns, *pair, files)
    shout([fault for compared in pair for fault in compared.configuration.faults])
    terminal = console()
    with terminal.status("comparing") as status:
        try:
            return run_comparison(families, *pair, repetitions=repetitions, tell=status.update)
        except (OwnFormulaError, LookupError) as error:
            raise UsageError(one_line(error)) from error
        except RuntimeError as error:
            # Dr.Jit wraps an error that a formula raises inside a loop.
            if isinstance(error.__cause__, OwnFormulaError):
                raise UsageError(one_line(error.__cause__)) from error
            raise


def show(result: "Compared", title: str, columns: Sequence[str], table: Sequence[Sequence[str]]) -> None:
    """Print the verdict, the control and the table of families, or a row for each value of a swept parameter."""
    if "sweep" not in result:
        say(result["verdict"])
        if control := result.get("control"):
            outside, many = control.get("families_outside", 0), len(control["families"])
            say(
                f"control, {result['base']} against itself: {control['verdict']} "
                f"Outside its interval: {outside} of {many}."
            )
    show_table(title, columns, table)
