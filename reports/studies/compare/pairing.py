"""Two contenders on one scene: the same rays, pixel against pixel."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.studies.compare.concerned import concerned
from rayproof.reports.studies.compare.contenders import Contender
from rayproof.reports.studies.compare.measured import Measured, measured
from rayproof.reports.studies.compare.received import as_received
from rayproof.reports.studies.compare.statistics import tile_medians
from rayproof.reports.studies.compare.tails import leaning
from rayproof.reports.studies.compare.truths import oracle_for, truth_of
from rayproof.tracer.render import render

TILES, PER_TILE = 64, 16  # of pixels in which both contenders found a value, in image order


@dataclass(frozen=True, kw_only=True)
class PairedStage:
    """What one stage of one scene says."""

    pixels: int  # at which the stage has a value
    only_base: int  # pixels that only the base decides wrongly
    only_candidate: int
    both_wrong: int
    same_inputs: bool  # the earlier stages are equal to the last bit
    digits: float  # median over pixels of log10(error of the base / error of the candidate); NaN without errors
    replicates: np.ndarray = field(repr=False)  # of `digits`, pixels drawn again in tiles
    better: float  # share of pixels at which the candidate errs less
    worse: float
    leaning: np.ndarray = field(repr=False)  # (height, width): -1 where only the candidate is far off, 1 only the base
    base: Measured = field(repr=False)
    candidate: Measured = field(repr=False)


def needed(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return what must be rendered so that every one of `stages` can be continued from what came before."""
    last = max(IMAGE_STAGES.index(Stage.DISTANCE if stage is Stage.OBJECT else stage) for stage in stages)
    return IMAGE_STAGES[: last + 1]


def paired(
    scene: Scene,
    stages: tuple[Stage, ...],
    base: Contender,
    others: Sequence[Contender],
    *,
    slots: Sequence[str],
    seed: int,
) -> list[dict[Stage, PairedStage]]:
    """Return the comparison of `base` with each of `others` on a scene, stage by stage.

    Only pixels that a change of `slots` can touch count. A truth is made anew where a contender's inputs are others.
    """
    received = as_received(scene)
    shapes = concerned(received, slots)
    contenders = [base, *others]
    _, oracle = oracle_for(received, {one.configuration.precision for one in contenders})
    answers = [render(received, needed(stages), one.configuration) for one in contenders]
    found: list[dict[Stage, PairedStage]] = [{} for _ in others]
    for stage in shown(scene, stages):
        truth = truth_of(received, stage, answers[0], oracle)
        first = measured(truth, stage, answers[0], precision=base.configuration.precision, shapes=shapes)
        for other, given, results in zip(others, answers[1:], found, strict=True):
            same = _same_inputs(stage, answers[0], given)
            own = truth if same else truth_of(received, stage, given, oracle)
            second = measured(own, stage, given, precision=other.configuration.precision, shapes=shapes)
            results[stage] = _pair(first, second, same=same, seed=seed)
    return found


def shown(scene: Scene, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    """Return the stages that a scene has anything to show of: without lights none from the visibility on."""
    lit = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
    return tuple(stage for stage in stages if scene.lights or stage not in lit)


def _same_inputs(stage: Stage, one: StageImages, other: StageImages) -> bool:
    earlier = IMAGE_STAGES[: IMAGE_STAGES.index(stage)]
    return all(np.array_equal(one[each], other[each], equal_nan=True) for each in earlier)


def _pair(base: Measured, candidate: Measured, *, same: bool, seed: int) -> PairedStage:
    ratio = np.log10(base.floored / candidate.floored)
    both = ratio[np.isfinite(ratio)]
    tiles = _tiles(both)
    counts = base.counts | candidate.counts
    # The coarser of two precisions excuses both; what float64 gains beyond it is the digits' affair.
    u = max(base.unit_roundoff, candidate.unit_roundoff)
    return PairedStage(
        pixels=int(np.count_nonzero(counts)),
        only_base=int(np.count_nonzero(base.wrong & ~candidate.wrong)),
        only_candidate=int(np.count_nonzero(candidate.wrong & ~base.wrong)),
        both_wrong=int(np.count_nonzero(base.wrong & candidate.wrong)),
        same_inputs=same,
        digits=float(np.median(both)) if len(both) else float("nan"),
        replicates=tile_medians(tiles, np.random.default_rng(seed)) if len(both) else np.empty(0),
        better=float(np.mean(both > 0)) if len(both) else 0.0,
        worse=float(np.mean(both < 0)) if len(both) else 0.0,
        leaning=leaning(*(one.scaled * (one.unit_roundoff / u) for one in (base, candidate))),
        base=base,
        candidate=candidate,
    )


def _tiles(values: np.ndarray) -> np.ndarray:
    """Return runs of neighbouring values, at most TILES x PER_TILE evenly chosen ones, padded with NaN."""
    per_tile = max(1, min(PER_TILE, len(values) // 8))
    starts = np.unique(np.linspace(0, max(0, len(values) - per_tile), TILES).astype(int))
    places = starts[:, np.newaxis] + np.arange(per_tile)
    return values[np.minimum(places, len(values) - 1)] if len(values) else np.empty((0, per_tile))
