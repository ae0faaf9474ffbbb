"""`rayproof grade`: grade a course's ray tracers; `rayproof new rubric` writes what it needs."""

import os
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder

INTERRUPTED = 130


def grade(
    submissions: Path,
    *,
    rubric: Path,
    out: Path = Path("grades"),
    unconfined: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Grade a course's ray tracers: points for each formula, the mistake in a sentence, one page for each student.

    For example: rayproof grade submissions --rubric rubric.toml --out grades

    Each submission is built and run confined (Linux): it finds its own folder, the system's programs and a scratch
    folder, and nothing else. What is finished is kept, so that the same command goes on where it was interrupted.

    Parameters
    ----------
    submissions
        The folder of the submissions, one sub-folder each.
    rubric
        The rubric, as `rayproof new rubric` writes it.
    out
        Folder for the grades: students/NAME is handed out, teacher is not.
    unconfined
        Grade even where programs cannot be confined here. They can then read and change all that you can, and every
        page says so.

    """
    from rayproof.reports.grading.classes import grade_class, names
    from rayproof.reports.grading.pages import Book
    from rayproof.reports.grading.rubric import load_rubric
    from rayproof.reports.grading.submission import Place, enclosure
    from rayproof.reports.results.files import several
    from rayproof.reports.subjects import Surroundings, reason_unconfined

    with told_in_one_line():
        asked = load_rubric(rubric)
        place = Place(submissions=submissions.resolve(), out=out.resolve(), confined=not unconfined)
        chosen = names(place)
        if not chosen:
            raise UsageError(f"{submissions} has no sub-folder: each submission is one")
        if place.submissions.is_relative_to(place.out) or place.out.is_relative_to(place.submissions):
            raise UsageError(f"--out {out} and the submissions must lie beside each other, not one in the other")
        writable_folder(place.out)
        place.out.chmod(0o700)  # of other users of this machine, too
        own(place.out)
        writable_folder(place.teacher)
        trial = enclosure(asked, place, place.submissions / chosen[0], products=None)
    if place.confined and (why := reason_unconfined(Surroundings(enclosure=trial))) is not None:
        raise UsageError(f"submissions cannot be confined: {why}; --unconfined grades them all the same")
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    say(f"{several(len(chosen), 'submission')}, {several(len(asked.cases), 'case')} ({len(asked.hidden)} hidden)")
    graded, interrupted = [], False
    try:
        for student in grade_class(asked, place, chosen, jobs=os.cpu_count() or 1):
            graded.append(student)
            said = student.problem.splitlines()[0] if student.problem else f"{student.points:g} points"
            say(f"{len(graded)} of {len(chosen)}: {student.name}: {said}")
    except KeyboardInterrupt:
        interrupted = True
    Book(rubric=asked, place=place, graded=sorted(graded, key=lambda student: student.name)).write()
    if interrupted:
        sys.stderr.write("rayproof: interrupted; the same command goes on\n")
        return INTERRUPTED
    say(f"hand out: {place.out / 'students'}; for you: {place.teacher / 'class.html'} and gradebook.csv")
    return 0
