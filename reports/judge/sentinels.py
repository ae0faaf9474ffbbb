"""The judge's self-test before a run (`stand_guard`): cases at edges, of each stage, of references and of the panel.

At edges, a level square is in front of a plane; its border passes exactly through the centres of a frame of pixels.
Such a pixel may show the square or the plane, but no third value.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from rayproof.cases.case import Case, PixelValue
from rayproof.cases.placement import frontal_fovy
from rayproof.cases.scene import Camera, Mesh, Plane, PointLight, Scene, Square
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge import case
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import adjudication
from rayproof.reports.judge.limit_sentinels import (
    CASE,
    SCENE,
    BrokenJudgeError,
    Sentinel,
    guard_limits,
    rounded,
    spoilt_at,
)
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.case_records import AdjudicationRecord, Number
from rayproof.reports.results.outcomes import Outcome

PIXEL, HEIGHT = 0.125, 4.0  # m: a pixel's side on the square, and the eye's height above it
SIDE = 0.875  # m; its half is an odd number of half pixels, so that the border passes through pixel centres
INNER = (7, 8)  # row, column of a pixel on the diagonal
BORDER = (4, 8)  # row, column of a pixel on the border: its centre is at x = 0.0625, y = 0.4375

# The same square as a mesh of two triangles.
CORNERS = np.array(((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))) * SIDE / 2
HALVES = Mesh(albedo=(0.7, 0.5, 0.3), vertices=CORNERS, faces=np.array(((0, 1, 2), (0, 2, 3))))


def edge_scene(side: float) -> Scene:
    """Return the scene with a square of the given side [m]."""
    return Scene(
        camera=Camera(
            eye=(0.0, 0.0, HEIGHT),
            target=(0.0, 0.0, 0.0),
            up=(0.0, 1.0, 0.0),
            fovy=frontal_fovy(height=16, pixel=PIXEL, distance=HEIGHT),
            width=16,
            height=16,
            near=0.1,
            far=20.0,
        ),
        shapes=(
            Square(albedo=(0.7, 0.5, 0.3), to_world=((side, 0, 0, 0), (0, side, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))),
            Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -1), (0, 0, 0, 1))),
        ),
        lights=(PointLight(position=(0.3, 0.2, 6.0), flux=(90.0, 70.0, 50.0)),),
    )


EDGE_CASE = Case(
    name="sentinel/edge",
    scene=edge_scene(SIDE),
    stresses="Nothing: its answers are spoiled on purpose.",
    covers=("HIT-7",),
    least_interior=100,
    most_explained=0.25,
)


def edge_sentinels(oracle: Analytic) -> Iterator[Sentinel]:
    """Yield the self-tests of the oracle's answers to the scene with an edge through pixel centres."""
    stages = stages_of(EDGE_CASE.scene)
    truth = oracle.render(EDGE_CASE.scene, stages)
    good = rounded(truth)

    def sentinel(name: str, subject: StageImages, outcome: Outcome, stage: Stage | None) -> Sentinel:
        return Sentinel(name=name, ours=subject, theirs=truth, outcome=outcome, stage=stage, case=EDGE_CASE)

    yield sentinel("faultless at an edge", good, Outcome.PASS, None)
    for word, side in (("inside", SIDE * (1 - 1e-9)), ("outside", SIDE * (1 + 1e-9))):
        moved = rounded(oracle.render(edge_scene(side), stages))
        yield sentinel(f"an edge seen from {word}", moved, Outcome.PASS, None)
    between = good | {Stage.DISTANCE: spoilt_at(good[Stage.DISTANCE], BORDER, HEIGHT + 0.4)}
    yield sentinel("neither side of an edge", between, Outcome.FAIL, Stage.DISTANCE)
    # If a program only renders radiance, no earlier stage determines which surface it should show.
    for value in (1e30, 1.001 * float(good[Stage.RADIANCE][(*BORDER, 0)])):
        bare: StageImages = {Stage.RADIANCE: spoilt_at(good[Stage.RADIANCE], BORDER, value)}
        yield sentinel(f"radiance alone, {value:.3g} at an edge", bare, Outcome.FAIL, Stage.RADIANCE)
    halves = replace(EDGE_CASE, scene=replace(EDGE_CASE.scene, shapes=(HALVES, EDGE_CASE.scene.shapes[1])))
    whole = oracle.render(halves.scene, stages)
    image = rounded(whole)[Stage.RADIANCE].copy()
    image[INNER] = 0.0
    yield Sentinel(
        name="a hole between two faces of a mesh, radiance alone",
        ours={Stage.RADIANCE: image},
        theirs=whole,
        outcome=Outcome.FAIL,
        stage=Stage.RADIANCE,
        case=halves,
    )
    missed = good | {Stage.OBJECT: spoilt_at(good[Stage.OBJECT], BORDER, -1.0)}
    yield sentinel("nothing at an edge", missed, Outcome.FAIL, Stage.OBJECT)


# Self-tests with several references: the wrong renderer is known, and must be determined by the votes of the others.


BLUNDER = 1.01  # a factor that exceeds every limit, because limits are only a few roundings


def witness_sentinels(truth: StageImages) -> Iterator[Sentinel]:
    """Yield the self-tests with several references for the oracle's answers to the usual scene."""
    good, suspect = rounded(truth), Outcome.REFERENCE_SUSPECT
    # It differs from the subject in the last bits, so that it is no copy, and equals the oracle.
    honest = third(truth)
    yield Sentinel(name="two who agree", ours=good, theirs=truth, outcome=Outcome.PASS, stage=None, others=(honest,))
    for stage in (Stage.RAY, Stage.NORMAL, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
        wrong = truth | {stage: truth[stage] * BLUNDER}
        yield Sentinel(
            name=f"{stage} of a third wrong",
            ours=good,
            theirs=truth,
            outcome=suspect,
            stage=stage,
            others=(third(wrong),),
        )
        yield Sentinel(
            name=f"{stage} of the oracle wrong",
            ours=good,
            theirs=wrong,
            outcome=suspect,
            stage=stage,
            others=(honest,),
            oracle=BlunderingOracle(stage),
        )
        spoilt = good | {stage: good[stage] * BLUNDER}
        yield Sentinel(
            name=f"{stage} wrong before two",
            ours=spoilt,
            theirs=truth,
            outcome=Outcome.FAIL,
            stage=stage,
            others=(honest,),
        )
    camera = truth[Stage.CAMERA] | {"projection": truth[Stage.CAMERA]["projection"] * BLUNDER}
    yield Sentinel(
        name="camera of a third wrong",
        ours=good,
        theirs=truth,
        outcome=suspect,
        stage=Stage.CAMERA,
        others=(third(truth | {Stage.CAMERA: camera}),),
    )
    copy = truth | {Stage.IRRADIANCE: good[Stage.IRRADIANCE]}
    yield Sentinel(
        name="copy of one stage", ours=good, theirs=truth, outcome=suspect, stage=None, others=(third(copy),)
    )


class BlunderingOracle(Analytic):
    """An oracle that is wrong in one stage."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage

    def image(self, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the image of a stage."""
        return values * BLUNDER if stage is self._stage else values


def third(answers: StageImages) -> Answers:
    """Return an independent reference in addition to the oracle."""
    return Answers(name="third", precision="float64", independent=True, answers=answers)


# Self-tests of the panel: the parts of a case's record about differing renderers, output steps, and conventions.


# Far above the float32 errors in the self-tests' pixels, and fine enough to distinguish these.
STEP = Resolution(relative=0.0, absolute=2.0**-13, because="a sentinel: coarse on purpose")
Record = dict[str, AdjudicationRecord]


def step_sentinels(truth: StageImages) -> Iterator[Sentinel]:
    """Yield the self-tests of coarse outputs: errors up to the declared step pass, larger errors fail."""
    good = rounded(truth)
    lit = np.where(truth[Stage.RADIANCE] > 0, STEP.absolute, 0.0)
    for share, outcome in ((0.9, Outcome.PASS), (1.5, Outcome.FAIL)):
        yield Sentinel(
            name=f"{share} of a declared step",
            ours=good | {Stage.RADIANCE: good[Stage.RADIANCE] + share * lit},
            theirs=truth,
            outcome=outcome,
            stage=Stage.RADIANCE if outcome is Outcome.FAIL else None,
            steps={Stage.RADIANCE: STEP},
        )


def panel_sentinels(truth: StageImages, oracle: Analytic) -> Iterator[tuple[Sentinel, Callable[[Record], str | None]]]:
    """Yield self-tests, each with a function that returns the error of its record, or None."""
    bright = truth | {Stage.RADIANCE: truth[Stage.RADIANCE] * BLUNDER}
    yield (
        Sentinel(
            name="a third alone",
            ours=rounded(truth),
            theirs=truth,
            outcome=Outcome.REFERENCE_SUSPECT,
            stage=Stage.RADIANCE,
            others=(third(bright),),
        ),
        _third_alone,
    )
    edge = oracle.render(EDGE_CASE.scene, stages_of(EDGE_CASE.scene))
    between = edge | {Stage.DISTANCE: spoilt_at(edge[Stage.DISTANCE], BORDER, HEIGHT + 0.4)}
    yield (
        Sentinel(
            name="a third off at an edge",
            ours=rounded(edge),
            theirs=edge,
            outcome=Outcome.REFERENCE_SUSPECT,
            stage=Stage.DISTANCE,
            case=EDGE_CASE,
            others=(third(between),),
        ),
        _off_at_an_edge,
    )


def _third_alone(record: Record) -> str | None:
    """Return the error in the record of a third renderer that is brighter than the others, or None."""
    names, radiance = ["sentinel", "analytic", "third"], record["radiance"]
    if any(stage["baseline"] != "analytic" or stage["renderers"] != names for stage in record.values()):
        return "it names another baseline, or other renderers"
    if [stage["alone"] for stage in record.values()] != [None] * (len(record) - 1) + ["third"]:
        return "it must say that the third stands alone at radiance, and nobody before"
    ratio, differing = _numbers(radiance["ratio"]), _numbers(radiance["differing"])
    if any(radiance["ratio"][place][place] is not None for place in range(3)):
        return "it compares a renderer with itself"
    if not (ratio[0][1] <= 1 and ratio[1][0] <= 1 and differing[0][1] == differing[1][0] == 0):
        return "two who agree differ in it"
    if not all(ratio[2][row] > 1 and ratio[row][2] > 1 and differing[2][row] > CASE.least_interior for row in (0, 1)):
        return "a third of one per cent more does not differ in it"
    conventions = radiance.get("conventions", [])
    if (
        not conventions
        or any(convention["explains"] for convention in conventions)
        or "Not explained" not in radiance["why"]
    ):
        return "a plain blunder is explained by a convention, or none was tested"
    return None


def _off_at_an_edge(record: Record) -> str | None:
    """Return the error in the record of a third renderer with a value at an edge that is neither side's, or None."""
    ratio = _numbers(record["distance"]["ratio"])
    if not (ratio[2][1] > 1 and ratio[2][0] > 1):
        return "the row of who has neither side's value at an edge passes"
    if not (ratio[0][1] <= 1 and ratio[1][0] <= 1):
        return "two who have a side's value at an edge differ"
    return None


def _numbers(rows: Sequence[Sequence[Number | None]]) -> list[list[float]]:
    """Return a table with NaN in place of None, which is neither within nor over a limit."""
    return [[math.nan if cell is None else float(cell) for cell in row] for row in rows]


# Self-tests of each stage: answers with a known verdict, judged before every run. If any verdict is wrong, the run
# ends.
#
# Each perturbs the oracle's answers to a small scene in one way, some by a little more than the limit, and has the
# expected verdict. They test the judge itself: limits, nearby problems, counting.


ITEMS = frozenset({"CAM-4", "HIT-1", "HIT-4", "LIT-1", "RAD-2"})
# Relative errors that must exceed every limit of this scene: forty times its limits, a hundredth of a blunder.
SLIGHT = {
    Stage.RAY: 3e-4,
    Stage.DISTANCE: 3e-4,
    Stage.POSITION: 3e-4,
    Stage.NORMAL: 3e-4,
    Stage.IRRADIANCE: 3e-4,
    Stage.EXITANCE: 3e-5,
    Stage.RADIANCE: 3e-5,
}


def sentinels(truth: StageImages, clear: tuple[int, int]) -> Iterator[Sentinel]:
    """Yield the self-tests of each stage for the oracle's answers; `clear` is a (row, column) far from edges."""
    good = rounded(truth)
    yield Sentinel(name="faultless", ours=good, theirs=truth, outcome=Outcome.PASS, stage=None)
    for stage, slight in SLIGHT.items():
        subject = good | {stage: good[stage] * (1 + slight)}
        yield Sentinel(name=f"{stage} off slightly", ours=subject, theirs=truth, outcome=Outcome.FAIL, stage=stage)
        for word, value in (("NaN", np.nan), ("infinite", np.inf)):
            spoilt = good | {stage: spoilt_at(good[stage], clear, value)}
            yield Sentinel(name=f"{stage} {word}", ours=spoilt, theirs=truth, outcome=Outcome.FAIL, stage=stage)
        smaller = good | {stage: good[stage][:1]}
        yield Sentinel(name=f"{stage} of one row", ours=smaller, theirs=truth, outcome=Outcome.FAIL, stage=stage)
        if good[stage].shape[-1] > 1:
            row, column = clear
            last = good[stage].copy()
            last[row, column, -1] *= 1 + slight
            last[row, column, -1] += slight * float(np.abs(good[stage][row, column]).max())
            spoilt = good | {stage: last}
            yield Sentinel(
                name=f"{stage} off in one channel", ours=spoilt, theirs=truth, outcome=Outcome.FAIL, stage=stage
            )
    for stage in truth:
        subject = {kept_stage: image for kept_stage, image in good.items() if kept_stage is not stage}
        yield Sentinel(name=f"no {stage}", ours=subject, theirs=truth, outcome=Outcome.UNSUPPORTED, stage=stage)
    incomplete = {kept_stage: image for kept_stage, image in truth.items() if kept_stage is not Stage.EXITANCE}
    yield Sentinel(name="reference without exitance", ours=good, theirs=incomplete, outcome=Outcome.MISSING, stage=None)
    camera = good | {Stage.CAMERA: truth[Stage.CAMERA] | {"view": truth[Stage.CAMERA]["view"] * 1.0003}}
    yield Sentinel(name="camera off slightly", ours=camera, theirs=truth, outcome=Outcome.FAIL, stage=Stage.CAMERA)
    for word, index in (("missed", -1.0), ("another", 1.0)):
        spoilt = good | {Stage.OBJECT: spoilt_at(good[Stage.OBJECT], clear, index)}
        yield Sentinel(name=f"object {word}", ours=spoilt, theirs=truth, outcome=Outcome.FAIL, stage=Stage.OBJECT)
    gone = good | {Stage.OBJECT: np.where(good[Stage.OBJECT] == 2, 1.0, good[Stage.OBJECT])}
    yield Sentinel(name="cube gone", ours=gone, theirs=truth, outcome=Outcome.FAIL, stage=Stage.OBJECT)
    lit = good | {Stage.VISIBILITY: spoilt_at(good[Stage.VISIBILITY], clear, 0.5)}
    yield Sentinel(name="half visible", ours=lit, theirs=truth, outcome=Outcome.FAIL, stage=Stage.VISIBILITY)
    yield Sentinel(name="crashed", ours=None, theirs=truth, outcome=Outcome.ERROR, stage=None)
    wrong = good | {Stage.RADIANCE: good[Stage.RADIANCE] * 1.5}
    yield Sentinel(name="copy", ours=wrong, theirs=wrong, outcome=Outcome.REFERENCE_SUSPECT, stage=None)
    many = replace(CASE, least_interior=10**6)
    yield Sentinel(name="too few pixels", ours=good, theirs=truth, outcome=Outcome.ERROR, stage=None, case=many)
    row, column = clear
    value = PixelValue(
        stage=Stage.IRRADIANCE,
        column=column,
        row=row,
        channel=0,
        value=1.01 * float(truth[Stage.IRRADIANCE][row, column, 0]),
        relative=1e-4,
        because="a sentinel: one per cent off",
    )
    closed = replace(CASE, expectations=(value,))
    yield Sentinel(
        name="closed form", ours=good, theirs=truth, outcome=Outcome.FAIL, stage=Stage.IRRADIANCE, case=closed
    )


def stand_guard(oracle: Analytic) -> int:
    """Judge every self-test and return their number.

    Raises:
        BrokenJudgeError: a self-test has the wrong verdict; the message names it.

    """
    truth = oracle.render(SCENE, tuple(Stage))
    try:
        count = guard_limits(oracle)
    except BrokenJudgeError:
        raise
    except Exception as error:  # any exception of a broken judge
        raise BrokenJudgeError(
            f"the judge is broken: it fell over known limits: {type(error).__name__}: {error}"
        ) from error
    usual = chain(
        sentinels(truth, _clear(truth)), witness_sentinels(truth), edge_sentinels(oracle), step_sentinels(truth)
    )
    whole = chain(((sentinel, None) for sentinel in usual), panel_sentinels(truth, oracle))
    for sentinel, error_of_record in whole:
        try:
            # Perturbed numbers overflow on purpose; a comparison that computes 0/0 is an error of the judge.
            with np.errstate(over="ignore", under="ignore", divide="raise", invalid="raise"):
                judged, subject = _judge(sentinel, oracle)
                wrong = (
                    error_of_record(adjudication(judged, [subject], oracle)) if error_of_record is not None else None
                )
        except Exception as error:  # any exception of a broken judge
            raise BrokenJudgeError(
                f"the judge is broken: it fell over sentinel {sentinel.name!r}: {type(error).__name__}: {error}"
            ) from error
        count += 1
        if judged.outcome is not sentinel.outcome or sentinel.stage not in (None, judged.stage):
            blamed = f" blaming {judged.stage}" if judged.stage else ""
            wanted = f"{sentinel.outcome}{f' blaming {sentinel.stage}' if sentinel.stage else ''}"
            raise BrokenJudgeError(
                f"the judge is broken: sentinel {sentinel.name!r} must end in {wanted}, got {judged.outcome}{blamed}"
            )
        if len(judged.checks) != judged.planned or judged.planned != len(Stage) * (1 + len(sentinel.others)):
            raise BrokenJudgeError(f"the judge is broken: {sentinel.name!r} lost a check it had planned")
        if wrong is not None:
            raise BrokenJudgeError(f"the judge is broken: the record of sentinel {sentinel.name!r} is wrong: {wrong}")
    return count


def _judge(sentinel: Sentinel, oracle: Analytic) -> tuple[Judged, Answers]:
    subject = Answers(
        name="sentinel",
        precision="float32",
        items=ITEMS,
        shadow_epsilon=1e-6,
        answers=sentinel.ours or {},
        error=None if sentinel.ours else "ended by a signal",
        resolutions=sentinel.steps,
    )
    reference = Answers(name="analytic", precision="float64", independent=True, answers=sentinel.theirs)
    references = [reference, *sentinel.others]
    oracle = sentinel.oracle or oracle
    return case.judge_case(sentinel.case, [subject], references, oracle, {}), subject


def _clear(truth: StageImages) -> tuple[int, int]:
    """Return the lit pixel (row, column) of the sphere that is farthest from any other pixel."""
    lit = (truth[Stage.OBJECT][..., 0] == 0) & (truth[Stage.VISIBILITY][..., 0] == 1)
    rows, columns = np.nonzero(lit)
    gaps = np.nonzero(~lit)
    distance = np.hypot(rows[:, np.newaxis] - gaps[0], columns[:, np.newaxis] - gaps[1]).min(axis=1)
    best = int(distance.argmax())
    return int(rows[best]), int(columns[best])
