"""`python -m tests.harness.grading`: grade a class of renderers with known mistakes, or hostile ones; print a table."""

import os
import shutil
import socket
import sys
import time
from pathlib import Path

from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line
from rayproof.reports.grading.classes import grade_class, names
from rayproof.reports.grading.pages import Book
from rayproof.reports.grading.rubric import load_rubric, starter
from rayproof.reports.grading.submission import Place
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.command_line import call
from tests.harness.grading import campaign, hostile


def grading(*, out: Path = Path("class"), share: float = 1.0, seed: int = 39, strangers: bool = False) -> int:
    """Grade a class made from the C++ example, a Python and a Rust renderer, with 0 to 3 known mistakes each.

    Ends with 0 if as many mistakes cost their item, and as few other items lose points, as docs/grading.md promises.

    Parameters
    ----------
    out
        Folder for submissions, rubric and grades. What it holds is not done again.
    share
        The share of forty students.
    seed
        Another seed draws other mistakes and hidden cases.
    strangers
        Instead, grade eight hostile submissions beside a right one. Ends with 0 if they gain nothing and harm nobody.

    """
    from tests.harness.audit.diagnosing import built, compiler, listed

    if compiler() is None or not 0 < share <= 1:
        raise UsageError("it takes a C++ compiler (c++, g++ or clang++) on the PATH and a share from 0 to 1")
    choose_packaged_llvm()
    with told_in_one_line():
        own(out)
    place = Place(submissions=(out / "submissions").resolve(), out=(out / "grades").resolve(), confined=True)
    place.teacher.mkdir(parents=True, exist_ok=True)
    if strangers:
        return _strangers(out.resolve(), place)
    (out / "rubric.toml").write_text(starter(seed), encoding="utf-8")
    rubric = load_rubric(out / "rubric.toml")
    program = built(out)
    switches = {campaign.CPP: campaign.usable(listed(program)), campaign.PYTHON: campaign.python_switches()}
    if shutil.which("rustc"):
        switches[campaign.RUST] = campaign.rust_switches()
    else:
        say("No rustc is on the PATH: the class has no students who write Rust.")
    students = campaign.drawn(switches, seed, share)
    campaign.write(students, place.submissions)
    start, graded = time.monotonic(), {}
    for one in grade_class(rubric, place, names(place), jobs=os.cpu_count() or 1):
        graded[one.name] = one
        say(f"{len(graded)} of {len(students)}: {one.name}: {one.points:g} points")
    Book(rubric=rubric, place=place, graded=sorted(graded.values(), key=lambda one: one.name)).write()
    for line in campaign.report(students, graded, rubric):
        say(line)
    say(f"{time.monotonic() - start:.0f} s by the clock")
    return 1 if campaign.broken(students, graded, rubric) else 0


def _strangers(out: Path, place: Place) -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.1)
        hostile.write(out, place.out, port=server.getsockname()[1])
        rubric = load_rubric(out / "rubric.toml")
        graded = list(grade_class(rubric, place, names(place), jobs=os.cpu_count() or 1))
        Book(rubric=rubric, place=place, graded=graded).write()
        try:
            server.accept()
            heard = True
        except TimeoutError:
            heard = False
    for one in graded:
        say(f"{one.name}: {one.points:g} points; {one.problem.splitlines()[0] if one.problem else 'it ran'}")
    found = hostile.problems(out, place.out, graded, heard=heard)
    for line in found:
        say(f"PROBLEM: {line}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(call(grading))
