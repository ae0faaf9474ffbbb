"""Diagrams of one slot on one family or ladder: every variant in both precisions, and Mitsuba."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder, all_ladders
from rayproof.cases.rounding import PRECISIONS, UNIT_ROUNDOFF
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference import REFERENCES
from rayproof.reports.studies.compare.contenders import concerned
from rayproof.reports.studies.compare.paired_errors import (
    RAYS,
    UNITS,
    Measured,
    StageTruth,
    enlarged,
    launch,
    measured,
    oracle_for,
    truth_of,
)
from rayproof.reports.studies.compare.records import as_received
from rayproof.reports.studies.stability.questions import QUESTIONS, Grades, Question
from rayproof.reports.studies.tradeoff.points import TradeoffPoint, UntimedPoint, kernel_seconds, quantile, tail
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.render import render

# Asked beside the tracer's formulas; its kernels run through Dr.Jit, so that they are timed by the same clock.
NEIGHBOUR = "mitsuba_llvm"
STAGES = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE)


@dataclass(frozen=True, kw_only=True)
class Task:
    """A diagram to be: a slot on the scenes of a family."""

    diagram: str
    slot: str
    formulas: tuple[Formula, ...]
    scenes: tuple[Scene, ...]


def variants(slot: str, named: Sequence[Formula] = ()) -> tuple[Formula, ...]:
    """Return the formulas of a slot without planted faults; if some are `named`, these, after the slot's default."""
    if not named:
        return tuple(one for one in FORMULAS.variants(slot) if one.kind != "fault")
    mine = [one for one in named if one.slot == slot]
    return (FORMULAS.variants(slot)[0], *(one for one in mine if not one.default)) if mine else ()


def entries(task: Task, tell: Callable[[str], None]) -> list[UntimedPoint]:
    """Return the points of one diagram, measured and ready to be timed."""
    tell(f"{task.diagram}: errors")
    scenes = [as_received(scene) for scene in task.scenes]
    large = enlarged(scenes[0], RAYS)
    truths: dict[tuple[int, bytes], StageTruth] = {}
    records = []
    for precision in PRECISIONS:
        for formula in task.formulas:
            one = Configuration(precision=precision, formulas={task.slot: formula.variant})
            marks = [
                _measured(task, number, render(scene, STAGES, one), precision, truths)
                for number, scene in enumerate(scenes)
            ]
            point = _point(task, "tracer", formula.variant, precision, formula.kind, marks)
            records.append(UntimedPoint(point=point, launch=partial(_traced, large, one), rays=pixels(large)))
    reference = REFERENCES[NEIGHBOUR]()
    if all(reference.unsupported(scene, Stage.DISTANCE) is None for scene in (*scenes, large)):
        marks = [
            _measured(task, number, reference.render(scene, STAGES), "float32", truths)
            for number, scene in enumerate(scenes)
        ]
        records.append(
            UntimedPoint(
                point=_point(task, NEIGHBOUR, "", "float32", "reference", marks),
                launch=lambda: kernel_seconds(lambda: reference.render(large, [Stage.DISTANCE])),
                rays=pixels(large),
            )
        )
    return records


def pixels(scene: Scene) -> int:
    """Return how many pixels a scene's image has."""
    return scene.camera.width * scene.camera.height


def _traced(scene: Scene, configuration: Configuration) -> float:
    return launch(scene, [Stage.DISTANCE], configuration)[0]


def _measured(
    task: Task, number: int, answers: StageImages, precision: str, truths: dict[tuple[int, bytes], StageTruth]
) -> Measured:
    """Measure the distances of a task's scene; formulas that received the same rays share their truth."""
    scene = as_received(task.scenes[number])
    key = (number, np.asarray(answers[Stage.RAY]).tobytes())
    if key not in truths:
        truths[key] = truth_of(scene, Stage.OBJECT, answers, oracle_for(scene, {precision})[1])
    return measured(truths[key], Stage.OBJECT, answers, precision=precision, shapes=concerned(scene, [task.slot]))


def _point(
    task: Task, renderer: str, variant: str, precision: str, kind: str, marks: Sequence[Measured]
) -> TradeoffPoint:
    # In units of float32's roundoff whatever the precision: else float64 would look no better.
    unit = UNIT_ROUNDOFF[precision] / UNIT_ROUNDOFF["float32"]
    error, error_interval = tail([mark.scaled * unit for mark in marks])
    counts = sum(int(np.count_nonzero(mark.counts)) for mark in marks)
    return TradeoffPoint(
        diagram=task.diagram,
        label=f"{variant or renderer}, {precision}",
        renderer=renderer,
        variant=variant,
        precision=precision,
        samples=1,
        kind=kind,
        clock="kernels",
        error=error,
        error_interval=error_interval,
        natural=quantile([mark.natural for mark in marks]),
        unit=UNITS[Stage.OBJECT],
        wrong=sum(int(np.count_nonzero(mark.wrong)) for mark in marks) / max(1, counts),
    )


# Diagrams of ladders: every variant of a ladder's slots, in both precisions, on the rays of one of its values.


LADDER_RAYS = 2**16  # in a timed launch; a question carries its rays to the device and back each time
LADDER = "ladder"  # the first half of a diagram's name
ALL = "ladders"  # the selector that names every one


def ladders(selectors: Sequence[str]) -> tuple[Ladder, ...]:
    """Return the sweeps that `selectors` name: a ladder, a pattern, or `ladders` for all."""
    sweeps = [ladder for ladder in all_ladders() if ladder.kind == "sweep"]
    return tuple(ladder for ladder in sweeps if any(one == ALL or fnmatchcase(ladder.name, one) for one in selectors))


def value_of(ladder: Ladder) -> float:
    """Return the value to ask at: the one that a good float32 formula must just reach, where the others have parted."""
    return ladder.gate.reaches.get("float32", ladder.values[len(ladder.values) // 2])


def ladder_entries(ladder: Ladder, tell: Callable[[str], None], named: Sequence[Formula] = ()) -> list[UntimedPoint]:
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
                UntimedPoint(
                    point=_ladder_point(ladder, formula, precision, grades),
                    launch=partial(_asked, question, ladder, formula, many, precision),
                    rays=LADDER_RAYS,
                )
            )
    return found


def enough(inputs: Inputs, rays: int) -> Inputs:
    """Return the inputs (rays,) as `RAYS` of them, repeats side by side.

    A run of rays with one matrix stays one run: each is a kernel's worth of code, which takes long to compile.
    """
    index = np.arange(LADDER_RAYS) * rays // LADDER_RAYS
    return {name: array[index] for name, array in inputs.items()}


def _asked(question: Question, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> float:
    """Return the seconds of asking a formula."""
    return kernel_seconds(lambda: question.answer(ladder, formula, inputs, precision))


def _ladder_point(ladder: Ladder, formula: Formula, precision: str, grades: Grades) -> TradeoffPoint:
    # In units of float32's roundoff whatever the precision, as everywhere.
    unit = UNIT_ROUNDOFF[precision] / UNIT_ROUNDOFF["float32"]
    wrong = (grades.false_hit | grades.false_miss | grades.invalid) & grades.counted
    error, interval = tail([grades.index[grades.counted] * unit])
    return TradeoffPoint(
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
