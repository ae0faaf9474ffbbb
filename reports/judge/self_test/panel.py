"""Sentinels of the panel: what a case's record must say of who differs from whom, of steps, and of conventions."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.oracle import FullOracle, stages_of
from rayproof.reports.judge.self_test.at_edges import BORDER, EDGE_CASE, HEIGHT
from rayproof.reports.judge.self_test.known_answer import CASE, Sentinel, rounded, spoilt_at
from rayproof.reports.judge.self_test.several_references import BLUNDER, third
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import AdjudicationRecord, Number

# Far above what float32 loses in the sentinels' pixels, and fine enough to tell them apart.
STEP = Resolution(relative=0.0, absolute=2.0**-13, because="a sentinel: coarse on purpose")
Record = dict[str, AdjudicationRecord]


def step_sentinels(truth: StageImages) -> Iterator[Sentinel]:
    """Yield the sentinels of coarse outputs: up to the declared step all is well, beyond it nothing is."""
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


def panel_sentinels(
    truth: StageImages, oracle: FullOracle
) -> Iterator[tuple[Sentinel, Callable[[Record], str | None]]]:
    """Yield sentinels, each with what says how their record is wrong, or None."""
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
            outcome=Outcome.PASS,
            stage=None,
            case=EDGE_CASE,
            others=(third(between),),
        ),
        _off_at_an_edge,
    )


def _third_alone(record: Record) -> str | None:
    """Return what is wrong with the record of a third that is brighter than the others."""
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
    if not all(ratio[2][one] > 1 and ratio[one][2] > 1 and differing[2][one] > CASE.least_interior for one in (0, 1)):
        return "a third of one per cent more does not differ in it"
    conventions = radiance.get("conventions", [])
    if not conventions or any(one["explains"] for one in conventions) or "Not explained" not in radiance["why"]:
        return "a plain blunder is explained by a convention, or none was tested"
    return None


def _off_at_an_edge(record: Record) -> str | None:
    """Return what is wrong with the record of a third with a value at an edge that is neither side's."""
    ratio = _numbers(record["distance"]["ratio"])
    if not (ratio[2][1] > 1 and ratio[2][0] > 1):
        return "the row of who has neither side's value at an edge passes"
    if not (ratio[1][2] <= 1 and ratio[0][2] <= 1):
        return "the rows of those who have a side's value at an edge fail"
    return None


def _numbers(rows: Sequence[Sequence[Number | None]]) -> list[list[float]]:
    """Return a table with NaN where it has nothing, which is within no limit and beyond none."""
    return [[math.nan if one is None else float(one) for one in row] for row in rows]
