"""Diagrams of ladders: every variant of a ladder's slots, in both precisions, on the rays of one of its values."""

from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder, all_ladders
from rayproof.cases.rounding import PRECISIONS, UNIT_ROUNDOFF
from rayproof.reports.studies.stability.questions import QUESTIONS, Grades, Question
from rayproof.reports.studies.tradeoff.clocks import kernel_seconds
from rayproof.reports.studies.tradeoff.entry import Entry
from rayproof.reports.studies.tradeoff.formulas import variants
from rayproof.reports.studies.tradeoff.points import Point
from rayproof.reports.studies.tradeoff.tails import quantile, tail
from rayproof.tracer.formulas import Formula

RAYS = 2**16  # in a timed launch; a question carries its rays to the device and back each time
LADDER = "ladder"  # the first half of a diagram's name
ALL = "ladders"  # the selector that names every one


def ladders(selectors: Sequence[str]) -> tuple[Ladder, ...]:
    """Return the sweeps that `selectors` name: a ladder, a pattern, or `ladders` for all."""
    sweeps = [ladder for ladder in all_ladders() if ladder.kind == "sweep"]
    return tuple(ladder for ladder in sweeps if any(one == ALL or fnmatchcase(ladder.name, one) for one in selectors))


def value_of(ladder: Ladder) -> float:
    """Return the value to ask at: the one that a good float32 formula must just reach, where the others have parted."""
    return ladder.gate.reaches.get("float32", ladder.values[len(ladder.values) // 2])


def ladder_entries(ladder: Ladder, tell: Callable[[str], None], named: Sequence[Formula] = ()) -> list[Entry]:
    """Return the points of one ladder, measured and ready to be timed. Both precisions get the same float32 numbers.

    If formulas are `named`, they are asked, beside the defaults of their slots.
    """
    tell(f"ladder {ladder.name}: errors")
    question = QUESTIONS[ladder.question]()
    inputs = ladder.draw(value_of(ladder), ladder.rays, np.random.default_rng(ladder.seed), "float32")
    rays = len(next(iter(inputs.values())))
    truth = question.truth(ladder, inputs, np.zeros(rays, dtype=int))
    many = enough(inputs, rays)
    formulas = [
        formula
        for slot in ladder.slots
        for formula in variants(slot, named)
        if named or not ladder.only or formula.variant in ladder.only
    ]
    found = []
    for precision in PRECISIONS:
        for formula in formulas:
            answer = question.answer(ladder, formula, inputs, precision)
            grades = question.grade(ladder, inputs, truth, answer, precision)
            found.append(
                Entry(
                    point=_point(ladder, formula, precision, grades),
                    launch=partial(_asked, question, ladder, formula, many, precision),
                    rays=RAYS,
                )
            )
    return found


def enough(inputs: Inputs, rays: int) -> Inputs:
    """Return the inputs (rays,) as `RAYS` of them, repeats side by side.

    A run of rays with one matrix stays one run: each is a kernel's worth of code, which takes long to compile.
    """
    index = np.arange(RAYS) * rays // RAYS
    return {name: array[index] for name, array in inputs.items()}


def _asked(question: Question, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> float:
    """Return the seconds of asking a formula."""
    return kernel_seconds(lambda: question.answer(ladder, formula, inputs, precision))


def _point(ladder: Ladder, formula: Formula, precision: str, grades: Grades) -> Point:
    # In units of float32's roundoff whatever the precision, as everywhere.
    unit = UNIT_ROUNDOFF[precision] / UNIT_ROUNDOFF["float32"]
    wrong = (grades.false_hit | grades.false_miss | grades.invalid) & grades.counted
    error, interval = tail([grades.index[grades.counted] * unit])
    return Point(
        diagram=f"{LADDER}/{ladder.name}",
        label=f"{formula.name if len(ladder.slots) > 1 else formula.variant}, {precision}",
        renderer="tracer",
        variant=formula.variant,
        precision=precision,
        samples=1,
        kind=formula.kind,
        clock="kernels",
        error=error,
        error_interval=interval,
        natural=quantile([grades.error[grades.counted]]),
        unit=ladder.unit,
        wrong=float(np.count_nonzero(wrong)) / max(1, int(np.count_nonzero(grades.counted))),
    )
