"""`rayproof compare`: two formulas, configurations or runs on the same rays - which errs less, and at what cost."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.lookup import scene_files
from rayproof.reports.commands.output import console, say, shout, show_table, write_json
from rayproof.reports.commands.usage import UsageError, one_line, own, told_in_one_line, writable_folder

if TYPE_CHECKING:  # it would load what only this command needs
    from rayproof.reports.studies.compare.records import FormulaComparison, RunComparison

REPETITIONS = 31
FEWEST = 9  # with fewer a 95 % interval of a median is the range of all values


def compare(
    base: str,
    candidate: str,
    *selectors: str,
    json: Path | None = None,
    out: Path | None = None,
    repetitions: int = REPETITIONS,
    precision: str = "float32",
) -> int:
    """Compare two formulas, configurations or finished runs.

    Parameters
    ----------
    base
        A formula such as sphere/haines, a function of your own, such as sphere=./mine.py:nearest_hit, a configuration
        such as float32/triangle=woop, or the folder of a finished run.
    candidate
        What to compare it with, named in the same way.
    selectors
        Families, cases, stresses or scene files. Default: those that use the formula in which the two differ.
    json
        Also write the comparison to this file.
    out
        Also write comparison.json and comparison.md to this folder.
    repetitions
        How often each is timed on each family, at least 9; an even number is raised by one.
    precision
        The precision in which formulas run.

    """
    if repetitions < FEWEST:
        raise UsageError(f"--repetitions must be at least {FEWEST}, got {repetitions}")
    with told_in_one_line():
        if out is not None:
            own(out)
        if json is not None:
            writable_folder(json.parent)
        runs = [Path(name) for name in (base, candidate) if Path(name).is_dir()]
    if len(runs) == 1:
        raise UsageError(f"{runs[0]} is a run; it can only be compared with another run")
    if runs:
        if selectors:
            raise UsageError("selectors do not apply to two finished runs")
        from rayproof.reports.history.run_difference import compare_runs

        with told_in_one_line():
            result = compare_runs(runs[0], runs[1])
    else:
        result = formulas(base, candidate, selectors, repetitions | 1, precision)
    show(result)
    write_json(json, result)
    if out is not None:
        from rayproof.reports.studies.compare.records import markdown

        write_json(out / "comparison.json", result)
        (out / "comparison.md").write_text(markdown(result), encoding="utf-8")
    return 0


def formulas(
    base: str, candidate: str, selectors: Sequence[str], repetitions: int, precision: str
) -> "FormulaComparison":
    """Return the comparison of two formulas or configurations."""
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.compare.comparison import compare as run_comparison
    from rayproof.reports.studies.compare.contenders import contender, questions, seen
    from rayproof.tracer.formulas.own_file import OwnFormulaError

    patterns, files = scene_files(selectors)
    with told_in_one_line():
        pair = seen(*(contender(name, precision=precision) for name in (base, candidate)))
        asked = questions(patterns, *pair, files)
    shout([fault for one in pair for fault in one.configuration.faults])
    terminal = console()
    with terminal.status("comparing") as status:
        try:
            return run_comparison(asked, *pair, repetitions=repetitions, tell=status.update)
        except (OwnFormulaError, LookupError) as error:
            raise UsageError(one_line(error)) from error
        except RuntimeError as error:
            # Dr.Jit wraps what a formula raises inside its loops.
            if isinstance(error.__cause__, OwnFormulaError):
                raise UsageError(one_line(error.__cause__)) from error
            raise


def show(result: "FormulaComparison | RunComparison") -> None:
    """Print the verdict, the families and the control."""
    from rayproof.reports.studies.compare.records import COLUMNS, rows

    say(result["verdict"])
    if control := result.get("control"):
        outside, many = control["families_outside"], len(control["families"])
        say(
            f"control, {result['base']} against itself: {control['verdict']} Outside its interval: {outside} of {many}."
        )
    table, columns = rows(result), COLUMNS["runs" if "changed" in result else "formulas"]
    show_table(f"{result['base']} -> {result['candidate']}", columns, table)
