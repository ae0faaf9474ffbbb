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

# A reference drawn next to the tracer's formulas; its kernels run through Dr.Jit, so the same clock times them.
NEIGHBOUR = "mitsuba_llvm"
STAGES = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE)


@dataclass(frozen=True, kw_only=True)
class Task:
    """A diagram to measure: a slot on the scenes of a family."""

    diagram: str
    slot: str
    formulas: tuple[Formula, ...]
    scenes: tuple[Scene, ...]


def variants(slot: str, named: Sequence[Formula] = ()) -> tuple[Formula, ...]:
    """Return the formulas of a slot without planted faults; if `named`, the slot's default and then only these."""
    if not named:
        return tuple(formula for formula in FORMULAS.variants(slot) if formula.kind != "fault")
    requested = [formula for formula in named if formula.slot == slot]
    return (FORMULAS.variants(slot)[0], *(formula for formula in requested if not formula.default)) if requested else ()


def entries(task: Task, tell: Callable[[str], None]) -> list[UntimedPoint]:
    """Return the points of one diagram, measured and ready to be timed."""
    tell(f"{task.diagram}: errors")
    scenes = [as_received(scene) for scene in task.scenes]
    large = enlarged(scenes[0], RAYS)
    truths: dict[tuple[int, bytes], StageTruth] = {}
    records = []
    for precision in PRECISIONS:
        for formula in task.formulas:
            configuration = Configuration(precision=precision, formulas={task.slot: formula.variant})
            marks = [
                _measured(task, number, render(scene, STAGES, configuration), precision, truths)
                for number, scene in enumerate(scenes)
            ]
            point = _point(task, "tracer", formula.variant, precision, formula.kind, marks)
            records.append(UntimedPoint(point=point, launch=partial(_traced, large, configuration), rays=pixels(large)))
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
    """Return the number of pixels of a scene's image."""
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
    # In units of float32's roundoff in every precision, so that precisions can be compared.
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


# Diagrams of ladders: every variant of a ladder's slots, in both precisions, on the rays at a single value.


LADDER_RAYS = 2**16  # in a timed launch; every launch uploads the rays to the device and downloads the answers
LADDER = "ladder"  # the first part of a diagram's name
ALL = "ladders"  # the selector of all ladders


def ladders(selectors: Sequence[str]) -> tuple[Ladder, ...]:
    """Return the sweeps that `selectors` name; a selector is a ladder's name, a pattern, or `ladders` for all."""
    sweeps = [ladder for ladder in all_ladders() if ladder.kind == "sweep"]
    return tuple(
        ladder
        for ladder in sweeps
        if any(selector == ALL or fnmatchcase(ladder.name, selector) for selector in selectors)
    )


def value_of(ladder: Ladder) -> float:
    """Return the ladder's value for a diagram: the last value where a good float32 formula must pass.

    At this value the errors of the variants already differ.
    """
    return ladder.gate.reaches.get("float32", ladder.values[len(ladder.values) // 2])


def ladder_entries(ladder: Ladder, tell: Callable[[str], None], named: Sequence[Formula] = ()) -> list[UntimedPoint]:
    """Return the points of one ladder, measured and ready to be timed. Both precisions get the same float32 numbers.

    If `named` is not empty, only these formulas and the defaults of their slots are measured.
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
    points = []
    for precision in PRECISIONS:
        for formula in formulas:
            answer = question.answer(ladder, formula, inputs, precision)
            grades = question.grade(ladder, inputs, truth, answer, precision)
            points.append(
                UntimedPoint(
                    point=_ladder_point(ladder, formula, precision, grades),
                    launch=partial(_asked, question, ladder, formula, many, precision),
                    rays=LADDER_RAYS,
                )
            )
    return points


def enough(inputs: Inputs, rays: int) -> Inputs:
    """Return `LADDER_RAYS` inputs made from inputs (rays,) by repeating each ray next to itself.

    A run of rays with one matrix stays one run, because every run adds code to the kernel, which takes long to compile.
    """
    index = np.arange(LADDER_RAYS) * rays // LADDER_RAYS
    return {name: array[index] for name, array in inputs.items()}


def _asked(question: Question, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> float:
    """Return the run time [s] of a formula's kernels on the inputs of a question."""
    return kernel_seconds(lambda: question.answer(ladder, formula, inputs, precision))


def _ladder_point(ladder: Ladder, formula: Formula, precision: str, grades: Grades) -> TradeoffPoint:
    # In units of float32's roundoff in every precision, as in the other diagrams.
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
