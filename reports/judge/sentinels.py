"""Sentinels: answers whose verdict is known, judged before every run. A judge that gets one wrong judges nothing.

Each spoils the oracle's own answers to a small scene in one way, some by a little more than the limit, and says what
must come of it. They guard the judge itself: limits, edge classes, counting, ledgers. A broken judge ends the run.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cases.answers import Answers
from cases.case import Case, PixelValue
from cases.scene import Camera, Cube, Plane, PointLight, Scene, Sphere
from cases.stages import Stage
from reports.judge import judging
from reports.judge.classes import Edges
from reports.judge.oracle import FullOracle, stages_of
from reports.judge.outcomes import Outcome
from reports.judge.parties import Candidate, Witness

SCENE = Scene(
    camera=Camera(
        eye=(3.1, -4.2, 2.6),
        target=(0.1, 0.2, 0.0),
        up=(0.1, 0.2, 1.0),
        fovy=34.0,
        width=24,
        height=18,
        near=0.1,
        far=60.0,
    ),
    shapes=(
        Sphere(albedo=(0.7, 0.5, 0.3), center=(0.3, -0.2, 0.3), radius=0.9),
        Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0.3), (0, 1, 0, 0.1), (0, 0, 1, -0.8), (0, 0, 0, 1))),
        Cube(albedo=(0.9, 0.2, 0.4), to_world=((0.8, -0.6, 0, 1.6), (0.6, 0.8, 0, 0.9), (0, 0, 1, -0.3), (0, 0, 0, 1))),
    ),
    lights=(PointLight(position=(1.7, -1.1, 4.2), flux=(90.0, 70.0, 50.0)),),
)
CASE = Case(
    name="sentinel/judge",
    scene=SCENE,
    stresses="Nothing: its answers are spoiled on purpose.",
    covers=("HIT-1",),
    least_interior=200,
    most_edge=0.05,
)
ITEMS = frozenset({"CAM-4", "HIT-1", "HIT-4", "LIT-1", "RAD-2"})
# Relative errors that no limit on this scene may let pass: forty times what it asks for, a hundredth of a blunder.
SLIGHT = {
    Stage.RAY: 3e-4,
    Stage.DISTANCE: 3e-4,
    Stage.POSITION: 3e-4,
    Stage.NORMAL: 3e-4,
    Stage.IRRADIANCE: 3e-4,
    Stage.EXITANCE: 3e-5,
    Stage.RADIANCE: 3e-5,
}


class BrokenJudgeError(RuntimeError):
    """The judge got a sentinel wrong: nothing that it says can be believed."""


@dataclass(frozen=True, kw_only=True)
class Sentinel:
    """Answers with a known verdict."""

    name: str
    ours: Answers | None
    theirs: Answers
    outcome: Outcome
    stage: Stage | None  # the one blamed; None: any
    case: Case = CASE


def sentinels(truth: Answers, clear: tuple[int, int]) -> Iterator[Sentinel]:
    """Yield the sentinels for the oracle's answers; `clear` is a (row, column) far from edges."""
    good = _rounded(truth)
    yield Sentinel(name="faultless", ours=good, theirs=truth, outcome=Outcome.PASS, stage=None)
    for stage, slight in SLIGHT.items():
        ours = good | {stage: good[stage] * (1 + slight)}
        yield Sentinel(name=f"{stage} off slightly", ours=ours, theirs=truth, outcome=Outcome.FAIL, stage=stage)
        for word, value in (("NaN", np.nan), ("infinite", np.inf)):
            spoilt = good | {stage: _with(good[stage], clear, value)}
            yield Sentinel(name=f"{stage} {word}", ours=spoilt, theirs=truth, outcome=Outcome.FAIL, stage=stage)
        smaller = good | {stage: good[stage][:1]}
        yield Sentinel(name=f"{stage} of one row", ours=smaller, theirs=truth, outcome=Outcome.FAIL, stage=stage)
    for stage in truth:
        ours = {one: image for one, image in good.items() if one is not stage}
        yield Sentinel(name=f"no {stage}", ours=ours, theirs=truth, outcome=Outcome.UNSUPPORTED, stage=stage)
    theirs = {one: image for one, image in truth.items() if one is not Stage.EXITANCE}
    yield Sentinel(name="reference without exitance", ours=good, theirs=theirs, outcome=Outcome.MISSING, stage=None)
    camera = good | {Stage.CAMERA: truth[Stage.CAMERA] | {"view": truth[Stage.CAMERA]["view"] * 1.0003}}
    yield Sentinel(name="camera off slightly", ours=camera, theirs=truth, outcome=Outcome.FAIL, stage=Stage.CAMERA)
    for word, index in (("missed", -1.0), ("another", 1.0)):
        spoilt = good | {Stage.OBJECT: _with(good[Stage.OBJECT], clear, index)}
        yield Sentinel(name=f"object {word}", ours=spoilt, theirs=truth, outcome=Outcome.FAIL, stage=Stage.OBJECT)
    gone = good | {Stage.OBJECT: np.where(good[Stage.OBJECT] == 2, 1.0, good[Stage.OBJECT])}
    yield Sentinel(name="cube gone", ours=gone, theirs=truth, outcome=Outcome.FAIL, stage=Stage.OBJECT)
    lit = good | {Stage.VISIBILITY: _with(good[Stage.VISIBILITY], clear, 0.5)}
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


def stand_guard(oracle: FullOracle) -> int:
    """Judge every sentinel and return how many there are.

    Raises:
        BrokenJudgeError: one came out otherwise than it must; the message names it.

    """
    truth = oracle.render(SCENE, stages_of(SCENE))
    once = _EdgesOnce(oracle)
    count = 0
    for sentinel in sentinels(truth, _clear(truth)):
        # Spoilt numbers overflow on purpose; how the judge takes them is what is looked at.
        with np.errstate(all="ignore"):
            judged = _judge(sentinel, once)
        count += 1
        if judged.outcome is not sentinel.outcome or sentinel.stage not in (None, judged.stage):
            blamed = f" blaming {judged.stage}" if judged.stage else ""
            wanted = f"{sentinel.outcome}{f' blaming {sentinel.stage}' if sentinel.stage else ''}"
            raise BrokenJudgeError(
                f"the judge is broken: sentinel {sentinel.name!r} must end in {wanted}, got {judged.outcome}{blamed}"
            )
        if len(judged.checks) != judged.planned:
            raise BrokenJudgeError(f"the judge is broken: {sentinel.name!r} lost a check it had planned")
    return count


class _EdgesOnce:
    """The oracle, with the edges of the one scene computed once."""

    def __init__(self, oracle: FullOracle) -> None:
        self.render, self.at, self.continue_from = oracle.render, oracle.at, oracle.continue_from
        self._edges = oracle.edges(SCENE)

    def edges(self, scene: Scene) -> Edges:
        """Return the edges of the sentinels' scene."""
        return self._edges


def _judge(sentinel: Sentinel, oracle: FullOracle) -> Any:
    candidate = Candidate(
        name="sentinel",
        precision="float32",
        items=ITEMS,
        shadow_epsilon=1e-6,
        answers=sentinel.ours,
        error=None if sentinel.ours else "ended by a signal",
    )
    witness = Witness(
        name="analytic", precision="float64", independent=True, shadow_epsilon=0.0, answers=sentinel.theirs
    )
    return judging.judge_case(sentinel.case, [candidate], [witness], oracle, {})


def _clear(truth: Answers) -> tuple[int, int]:
    """Return the lit pixel of the sphere whose neighbourhood is the sphere's for the widest."""
    seen = (truth[Stage.OBJECT][..., 0] == 0) & (truth[Stage.VISIBILITY][..., 0] == 1)
    rows, columns = np.nonzero(seen)
    gaps = np.nonzero(~seen)
    distance = np.hypot(rows[:, np.newaxis] - gaps[0], columns[:, np.newaxis] - gaps[1]).min(axis=1)
    best = int(distance.argmax())
    return int(rows[best]), int(columns[best])


def _rounded(answers: Answers) -> Answers:
    """Return answers as a faultless float32 renderer gives them."""
    return {
        stage: image if stage is Stage.CAMERA else np.asarray(image).astype(np.float32).astype(np.float64)
        for stage, image in answers.items()
    }


def _with(image: np.ndarray, pixel: tuple[int, int], value: float) -> np.ndarray:
    """Return a copy of an image with the first channel of one pixel replaced."""
    changed = image.copy()
    changed[(*pixel, 0)] = value
    return changed
