"""`rayproof vectors`: write test vectors of ray formulas for any language, and judge answers to them."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cyclopts import App

from rayproof.reports.commands.output import say, show_table
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.vectors.judging import FileJudgement

WORST = 5  # failing rows of a file that are printed


app = App(name="vectors", help="Write test vectors of ray formulas for any language, or judge answers to them.")


@app.command
def write(*slots: str, out: Path) -> int:
    """Write test vectors of ray formulas as CSV and JSON, and a program that checks answers to them.

    Parameters
    ----------
    slots
        Slots such as sphere or falloff, or names of files such as box. Default: all.
    out
        The folder for the vectors.

    """
    with told_in_one_line():
        own(out)
    from rayproof.reports.vectors import files as vector_files

    texts = vector_files.write(out, _files(slots))
    say(f"{sum(text.count(chr(10)) - 1 for name, text in texts.items() if name.endswith('.csv'))} rows in {out}")
    return 0


def _files(slots: tuple[str, ...]) -> list[str]:
    from rayproof.reports.vectors import NO_FILE, SLOTS_OF

    wanted: dict[str, None] = {}
    for slot in slots:
        files = [file for file, own_slots in SLOTS_OF.items() if slot in (*own_slots, file)]
        if slot in NO_FILE:
            raise UsageError(f"{slot} has no vectors: {NO_FILE[slot]}")
        if not files:
            all_names = sorted({name for file, names in SLOTS_OF.items() for name in (file, *names)})
            raise UsageError(f"no slot is called {slot!r}; known: {', '.join(all_names)}")
        wanted |= dict.fromkeys(files)
    return list(wanted or SLOTS_OF)


@app.command
def judge(answers: Path, *, precision: Literal["float32", "float64"] = "float32", out: Path | None = None) -> int:
    """Judge a file of answers to test vectors.

    Parameters
    ----------
    answers
        The CSV file of the answers, with columns such as id,hit,t; docs/vectors.md describes them.
    precision
        The precision whose limits apply, float32 or float64.
    out
        Write junit.xml and vectors.md to this folder.

    """
    if out is not None:
        with told_in_one_line():
            own(out)
    from rayproof.reports.vectors.check import WrongFileError, read_answers
    from rayproof.reports.vectors.rows import everything

    try:
        read = read_answers(answers, everything()[0])
    except WrongFileError as error:
        raise UsageError(str(error)) from error
    from rayproof.reports.results.files import write_text
    from rayproof.reports.vectors import judging
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    judgement = judging.judge(read, precision)
    if out is not None:
        with told_in_one_line():
            write_text(out / "junit.xml", judging.junit(judgement))
            write_text(out / "vectors.md", judging.markdown(judgement))
    _show(judgement)
    return judgement.exit_code


def _show(judgement: "FileJudgement") -> None:
    from rayproof.reports.vectors.judging import LADDERS_TITLE, reach_cell

    rows = []
    for file in judgement.files:
        own_verdicts = judgement.of_file(file)
        worst = max(own_verdicts, key=lambda verdict: verdict.ratio)
        counts = [sum(v.outcome == outcome for v in own_verdicts) for outcome in ("passed", "failed", "skipped")]
        rows.append([file, *counts, worst.id, f"{worst.ratio:.3g}"])
    title = f"{judgement.name}, {judgement.precision}"
    show_table(title, ["file", "passed", "failed", "skipped", "worst row", "of its limit"], rows)
    reaches = [[reach.ladder.name, reach.ladder.parameter, reach_cell(reach)] for reach in judgement.reaches]
    show_table(LADDERS_TITLE, ["ladder", "what grows", "right up to"], reaches)
    for file in judgement.files:
        for verdict in [v for v in judgement.of_file(file) if v.outcome == "failed"][:WORST]:
            say(f"{verdict.id} fails: {verdict.because}")
    for file, sentence in judgement.alike.items():
        say(f"{file}: {sentence}")
    failed = sum(verdict.outcome == "failed" for verdict in judgement.verdicts)
    say(f"{len(judgement.verdicts)} rows and relations, {failed} fail")
