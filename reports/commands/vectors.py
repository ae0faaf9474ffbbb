"""`rayproof vectors`: inputs and certified answers of ray formulas as files for any language, and answers judged."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rayproof.reports.commands.output import say, show_table
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.vectors.judging import FileJudgement

WORST = 5  # failing rows shown of a file


def vectors(
    *slots: str,
    out: Path | None = None,
    judge: Path | None = None,
    precision: Literal["float32", "float64"] = "float32",
) -> int:
    """Write test vectors of ray formulas as CSV and JSON, with a checker beside them; or judge a file of answers.

    Parameters
    ----------
    slots
        Slots such as sphere or falloff, or files such as box. Default: all.
    out
        Write the vectors into this folder; with --judge: junit.xml and vectors.md.
    judge
        Judge the answers in this CSV file, whose columns, such as id,hit,t, docs/vectors.md describes.
    precision
        With --judge: whose limits hold, float32's or float64's.

    """
    if judge is None and out is None:
        raise UsageError("--out DIR writes the vectors, --judge ANSWERS.csv judges answers: one of them is needed")
    if slots and judge is not None:
        raise UsageError(f"--judge takes no slots, got {slots[0]}: the ids in the file say which vectors are answered")
    if out is not None:
        with told_in_one_line():
            own(out)
    if judge is not None:
        return _judged(judge, precision, out)
    from rayproof.reports.vectors.files import write

    files = _files(slots)
    texts = write(out or Path(), files)
    say(f"{sum(text.count(chr(10)) - 1 for name, text in texts.items() if name.endswith('.csv'))} rows in {out}")
    return 0


def _files(slots: tuple[str, ...]) -> list[str]:
    from rayproof.reports.vectors import NO_FILE, SLOTS_OF

    wanted: dict[str, None] = {}
    for slot in slots:
        found = [file for file, own_slots in SLOTS_OF.items() if slot in (*own_slots, file)]
        if slot in NO_FILE:
            raise UsageError(f"{slot} has no vectors: {NO_FILE[slot]}")
        if not found:
            known = sorted({name for file, names in SLOTS_OF.items() for name in (file, *names)})
            raise UsageError(f"no slot is called {slot!r}; known: {', '.join(known)}")
        wanted |= dict.fromkeys(found)
    return list(wanted or SLOTS_OF)


def _judged(path: Path, precision: str, out: Path | None) -> int:
    from rayproof.reports.vectors.check import WrongFileError, read_answers
    from rayproof.reports.vectors.rows import everything

    try:
        answers = read_answers(path, everything()[0])
    except WrongFileError as error:
        raise UsageError(str(error)) from error
    from rayproof.reports.results.files import write_text
    from rayproof.reports.vectors.judging import judge, junit, markdown
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    judgement = judge(answers, precision)
    if out is not None:
        with told_in_one_line():
            write_text(out / "junit.xml", junit(judgement))
            write_text(out / "vectors.md", markdown(judgement))
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
