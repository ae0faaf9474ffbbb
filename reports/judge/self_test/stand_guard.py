"""Sentinels: answers whose verdict is known, judged before every run. A judge that gets one wrong judges nothing.

Each spoils the oracle's own answers to a small scene in one way, some by a little more than the limit, and says what
must come of it. They guard the judge itself: limits, edge classes, counting, ledgers. A broken judge ends the run.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from rayproof.cases.case import PixelValue
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge import judge_case
from rayproof.reports.judge.oracle import FullOracle
from rayproof.reports.judge.panel_record import adjudication
from rayproof.reports.judge.renderers import Candidate, Witness
from rayproof.reports.judge.self_test.at_edges import edge_sentinels
from rayproof.reports.judge.self_test.known_answer import CASE, SCENE, BrokenJudgeError, Sentinel, rounded, spoilt_at
from rayproof.reports.judge.self_test.limits_by_hand import guard_limits
from rayproof.reports.judge.self_test.panel import panel_sentinels, step_sentinels
from rayproof.reports.judge.self_test.several_references import witness_sentinels
from rayproof.reports.judge.tolerance.edges import Edges
from rayproof.reports.judge.verdict.case_verdict import Judged
from rayproof.reports.results.outcomes import Outcome

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


def sentinels(truth: StageImages, clear: tuple[int, int]) -> Iterator[Sentinel]:
    """Yield the sentinels for the oracle's answers; `clear` is a (row, column) far from edges."""
    good = rounded(truth)
    yield Sentinel(name="faultless", ours=good, theirs=truth, outcome=Outcome.PASS, stage=None)
    for stage, slight in SLIGHT.items():
        ours = good | {stage: good[stage] * (1 + slight)}
        yield Sentinel(name=f"{stage} off slightly", ours=ours, theirs=truth, outcome=Outcome.FAIL, stage=stage)
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
        ours = {one: image for one, image in good.items() if one is not stage}
        yield Sentinel(name=f"no {stage}", ours=ours, theirs=truth, outcome=Outcome.UNSUPPORTED, stage=stage)
    theirs = {one: image for one, image in truth.items() if one is not Stage.EXITANCE}
    yield Sentinel(name="reference without exitance", ours=good, theirs=theirs, outcome=Outcome.MISSING, stage=None)
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


def stand_guard(oracle: FullOracle) -> int:
    """Judge every sentinel and return how many there are.

    Raises:
        BrokenJudgeError: one came out otherwise than it must; the message names it.

    """
    truth = oracle.render(SCENE, tuple(Stage))
    once = _EdgesOnce(oracle)
    try:
        count = guard_limits(once)
    except BrokenJudgeError:
        raise
    except Exception as fall:  # whatever a broken judge raises
        raise BrokenJudgeError(
            f"the judge is broken: it fell over known limits: {type(fall).__name__}: {fall}"
        ) from fall
    usual = chain(
        sentinels(truth, _clear(truth)), witness_sentinels(truth), edge_sentinels(oracle), step_sentinels(truth)
    )
    whole = chain(((sentinel, None) for sentinel in usual), panel_sentinels(truth, oracle))
    for sentinel, said in whole:
        try:
            # Spoilt numbers overflow on purpose; a comparison that ends in 0/0 is the judge's own fault.
            with np.errstate(over="ignore", under="ignore", divide="raise", invalid="raise"):
                judged, candidate, witnesses = _judge(sentinel, once)
                wrong = said(adjudication(judged, [candidate], witnesses, once)) if said is not None else None
        except Exception as fall:  # whatever a broken judge raises
            raise BrokenJudgeError(
                f"the judge is broken: it fell over sentinel {sentinel.name!r}: {type(fall).__name__}: {fall}"
            ) from fall
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


class _EdgesOnce:
    """The oracle, with the edges of each scene computed once."""

    def __init__(self, oracle: FullOracle) -> None:
        self.render, self.at, self.continue_from = oracle.render, oracle.at, oracle.continue_from
        self.surroundings, self.near = oracle.surroundings, oracle.near
        self._oracle = oracle
        self._known: list[tuple[Scene, Edges]] = []

    def edges(self, scene: Scene) -> Edges:
        """Return the edges of one of the sentinels' scenes."""
        found = next((edges for known, edges in self._known if known is scene), None)
        if found is None:
            found = self._oracle.edges(scene)
            self._known.append((scene, found))
        return found


def _judge(sentinel: Sentinel, oracle: FullOracle) -> tuple[Judged, Candidate, list[Witness]]:
    candidate = Candidate(
        name="sentinel",
        precision="float32",
        items=ITEMS,
        shadow_epsilon=1e-6,
        answers=sentinel.ours,
        error=None if sentinel.ours else "ended by a signal",
        resolutions=sentinel.steps,
    )
    witness = Witness(
        name="analytic", precision="float64", independent=True, shadow_epsilon=0.0, answers=sentinel.theirs
    )
    witnesses = [witness, *sentinel.others]
    return judge_case.judge_case(sentinel.case, [candidate], witnesses, oracle, {}), candidate, witnesses


def _clear(truth: StageImages) -> tuple[int, int]:
    """Return the lit pixel of the sphere whose neighbourhood is the sphere's for the widest."""
    seen = (truth[Stage.OBJECT][..., 0] == 0) & (truth[Stage.VISIBILITY][..., 0] == 1)
    rows, columns = np.nonzero(seen)
    gaps = np.nonzero(~seen)
    distance = np.hypot(rows[:, np.newaxis] - gaps[0], columns[:, np.newaxis] - gaps[1]).min(axis=1)
    best = int(distance.argmax())
    return int(rows[best]), int(columns[best])
