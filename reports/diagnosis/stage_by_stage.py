"""`explanations` of a renderer that writes every stage: one mistake or two, each at the stage where it is made.

A stage is judged as it follows from the renderer's own stages before it. The first stage that is wrong so has a mistake
of its own; what is left when that is explained is another's.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.diagnosis import Fit, Way
from rayproof.reports.diagnosis.answering import LIGHT
from rayproof.reports.diagnosis.fits import from_stages
from rayproof.reports.diagnosis.hypotheses import (
    Clock,
    Hypothesis,
    bound,
    fits,
    in_one_light,
    joined,
    middle,
    singles,
    sought,
    together,
)
from rayproof.reports.diagnosis.trials import NOTHING, Continued, work

LOOKED_AT = 24  # failing cases that every hypothesis has to explain before it meets the others
ALIKE = 4  # of these so many are wrong at the same stages
MEETING = 4  # cases that a hypothesis meets before the rest of them
FIRSTS = 12  # hypotheses of the first wrong stage that a second is looked for beside


def explanations(failing: Sequence[Continued], modes: Sequence[str], clock: Clock) -> Iterator[Hypothesis]:
    """Yield mistakes that leave nothing unexplained in a few failing cases; where there is none, pairs that do.

    `modes` are the models of light of all cases: a renderer that passes with one of them may be wrong in the other.
    """
    look = _looked_at(failing)
    known = list(singles(lambda fit, way: _estimated(fit, way, look, NOTHING)))
    known += in_one_light(known, modes)
    left = _first_unexplained(look, NOTHING)
    if left is None:
        return
    stage, shown = left
    firsts: list[Hypothesis] = []
    whole: list[Hypothesis] = []
    for traced in (False, True):  # those that the tracer has to answer for where no other has a name
        some = [one for one in known if bool(one.way.formulas) == traced]
        some = [one for one in some if not clock.over and _explains(one.way, stage, shown[:MEETING])]
        whole += [one for one in some if _first_unexplained(look, one.way) is None]
        # A factor that was estimated may be that of a formula: it is no reason to ask no formula.
        firsts += some if all(one.parameters for one in firsts) else []
        if any(not one.parameters for one in whole):
            break
    yield from whole
    if whole:
        return
    # Of rays pairs are cheap to ask, and two known mistakes of a camera are one free camera, too: the names come first.
    of_two, of_fits = _two(known, firsts, stage, shown, look, clock), _fitted(stage, shown, look, clock)
    for some in (of_two, of_fits) if stage is Stage.RAY else (of_fits, of_two):
        found = False
        for one in some:
            found = True
            yield one
        if found:
            return


def _fitted(stage: Stage, shown: Sequence[Continued], look: Sequence[Continued], clock: Clock) -> Iterator[Hypothesis]:
    """Yield what is fitted to half of the cases in which a stage is wrong and leaves nothing unexplained."""
    for one in fits(from_stages(shown[::2]), clock):
        if _explains(one.way, stage, shown[:MEETING]) and _first_unexplained(look, one.way) is None:
            yield one


def _two(
    known: Sequence[Hypothesis],
    firsts: list[Hypothesis],
    stage: Stage,
    shown: Sequence[Continued],
    look: Sequence[Continued],
    clock: Clock,
) -> Iterator[Hypothesis]:
    """Yield two mistakes that leave nothing unexplained; `firsts` are those that explain the first wrong stage."""
    if not firsts:  # both spoil this stage, and one of them alone may show in some cases
        firsts = [one for one in known if any(_explains(one.way, stage, [case]) for case in shown[: 2 * MEETING])]
        firsts.sort(key=lambda one: -sum(case.agrees(one.way, stage) is True for case in shown))
    if firsts:
        for first in firsts[:FIRSTS]:
            yield from _beside(first, known, look, clock)
        return
    change = [one for one in known if any(case.changes(one.way, stage) for case in shown[:MEETING])]
    for index, first in enumerate(change):
        for second in change[index + 1 :]:
            for pair in () if clock.over else together(first, second):
                if _explains(pair.way, stage, shown[:MEETING]) and _first_unexplained(look, pair.way) is None:
                    yield pair


def _beside(
    first: Hypothesis, known: Sequence[Hypothesis], look: Sequence[Continued], clock: Clock
) -> Iterator[Hypothesis]:
    """Yield a mistake of the first wrong stage with another that explains what it leaves."""
    left = _first_unexplained(look, first.way)
    if left is None:
        return
    stage, shown = left
    shared = any(case.changes(first.way, stage) for case in shown)
    fitted = list(singles(lambda fit, way: _estimated(fit, way, look, first.way))) if shared else []
    for second in [*known, *(one for one in fitted if one.parameters)]:
        if clock.over:
            return
        if not shared and not _explains(second.way, stage, shown[:MEETING]):
            continue
        for pair in together(first, second):
            if _explains(pair.way, stage, shown[:MEETING]) and _first_unexplained(look, pair.way) is None:
                yield pair


def _looked_at(failing: Sequence[Continued]) -> list[Continued]:
    """Return a few failing cases, of each kind of wrong stages some."""
    count: dict[tuple[Stage, ...], int] = {}
    found = []
    for case in failing:
        if case.wrong:
            count[case.wrong] = count.get(case.wrong, 0) + 1
            if count[case.wrong] <= ALIKE:
                found.append(case)
    return found[:LOOKED_AT]


def _first_unexplained(look: Sequence[Continued], way: Way) -> tuple[Stage, list[Continued]] | None:
    """Return the first stage that a way does not explain in some case, and the cases in which it does not."""
    for stage in IMAGE_STAGES:
        shown = [case for case in look if case.agrees(way, stage) is False]
        if shown:
            return stage, sorted(shown, key=lambda case: work(case.evidence.scene))
    return None


def _explains(way: Way, stage: Stage, shown: Sequence[Continued]) -> bool:
    """Say whether no case contradicts a way at a stage; where it has no answer, a case says nothing."""
    some = False
    for case in shown:
        agrees = case.agrees(way, stage)
        if agrees is False:
            return False
        some |= agrees is True
    return some


def _estimated(fit: Fit, way: Way, look: Sequence[Continued], beside: Way) -> float | None:
    """Return a parameter's estimate from cases in which the stages before are the renderer's own."""
    if not fit.grid:
        lit = [case for case in look if case.evidence.scene.lights]
        found = []
        for case in lit:
            follows = {stage: case.value(beside, stage) for stage in LIGHT}
            right = case.own | {stage: value for stage, value in follows.items() if value is not None}
            found.append(fit.samples(case.evidence.scene, right, case.own))
        return middle(found, fit.nothing)
    (stage,) = way.stages
    before = {case.evidence.case: tally.off for case in look if (tally := case.tally(beside, stage)) is not None}
    shown = sorted(
        (case for case in look if before.get(case.evidence.case)), key=lambda one: -before[one.evidence.case]
    )[:2]

    def off(value: float) -> float:
        both = bound(way, value)
        if beside is not NOTHING:
            (both, *_) = joined(beside, both) or [both]
        tallies = [case.tally(both, stage) for case in shown]
        return float(np.sum([np.inf if tally is None else tally.off for tally in tallies]))

    return sought(fit.grid, off, sum(before[case.evidence.case] for case in shown))
