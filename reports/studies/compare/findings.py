"""What a comparison found: per family and in all, as plain numbers with their intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.studies.compare.measured import UNITS
from rayproof.reports.studies.compare.pairing import PairedStage
from rayproof.reports.studies.compare.statistics import (
    Interval,
    mcnemar,
    median_interval,
    percentile_interval,
    scene_means,
)
from rayproof.reports.studies.compare.tails import Tail

# An error changed by less than a twentieth is not worth a word, however surely it changed.
LEAST_DIGITS = math.log10(1.05)
QUANTILES = {"median": 0.5, "p99": 0.99, "worst": 1.0}


@dataclass(frozen=True, kw_only=True)
class Errors:
    """How far off one contender is in one family, over the pixels that it decides rightly."""

    scaled: dict[str, float]  # error / (K u): median, p99, worst
    natural: dict[str, float]
    unit: str


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One family, or all of them; `None` stands for what does not apply, such as the digits of a yes or no."""

    family: str
    stress: bool
    scenes: int
    pixels: int
    same_inputs: bool
    digits: float | None
    digits_interval: Interval | None
    replicates: np.ndarray | None
    only_base: int
    only_candidate: int
    both_wrong: int
    p: float
    better: float
    worse: float
    tail: Tail
    errors: dict[str, tuple[Errors, Errors]]  # by stage: base, candidate


@dataclass(frozen=True, kw_only=True)
class Timing:
    """A time ratio, candidate over base, and the nanoseconds per ray behind it."""

    ratio: float
    interval: Interval
    nanoseconds: tuple[float, float]  # per ray: median of the base, of the candidate
    compile_seconds: tuple[float, float]
    ratios: np.ndarray  # one a repetition


def finding(
    family: str, stress: bool, scenes: Sequence[Mapping[Stage, PairedStage]], *, level: float, seed: int
) -> Finding:
    """Return what one family says; scenes in which nothing counted say nothing."""
    pairs = [(stage, pair) for scene in scenes for stage, pair in scene.items() if pair.pixels]
    generator = np.random.default_rng(seed)
    per_scene = [[pair for pair in scene.values() if len(pair.replicates)] for scene in scenes]
    per_scene = [found for found in per_scene if found]
    digits = interval = replicates = None
    if per_scene:
        digits = float(np.mean([np.mean([pair.digits for pair in found]) for found in per_scene]))
        scenes_drawn = np.array([np.mean([pair.replicates for pair in found], axis=0) for found in per_scene])
        replicates = scene_means(scenes_drawn, generator)
        interval = percentile_interval(replicates, level=level)
    only_base, only_candidate = (
        sum(getattr(pair, name) for _, pair in pairs) for name in ("only_base", "only_candidate")
    )
    return Finding(
        family=family,
        stress=stress,
        scenes=sum(any(pair.pixels for pair in scene.values()) for scene in scenes),
        pixels=sum(pair.pixels for _, pair in pairs),
        same_inputs=all(pair.same_inputs for _, pair in pairs),
        digits=digits,
        digits_interval=interval,
        replicates=replicates,
        only_base=only_base,
        only_candidate=only_candidate,
        both_wrong=sum(pair.both_wrong for _, pair in pairs),
        p=mcnemar(only_base, only_candidate),
        better=float(np.mean([pair.better for _, pair in pairs])) if pairs else 0.0,
        worse=float(np.mean([pair.worse for _, pair in pairs])) if pairs else 0.0,
        tail=Tail.of([np.sum([pair.leaning for pair in scene.values()], axis=0) for scene in scenes if scene]),
        errors={
            stage.value: _errors(stage, [pair for at, pair in pairs if at is stage])
            for stage in dict.fromkeys(stage for stage, _ in pairs)
        },
    )


def _errors(stage: Stage, pairs: Sequence[PairedStage]) -> tuple[Errors, Errors]:
    def of(name: str) -> Errors:
        parties = [getattr(pair, name) for pair in pairs]
        scaled, natural = (
            np.concatenate([getattr(party, kind)[np.isfinite(getattr(party, kind))] for party in parties])
            for kind in ("scaled", "natural")
        )
        return Errors(scaled=_quantiles(scaled), natural=_quantiles(natural), unit=UNITS[stage])

    return of("base"), of("candidate")


def _quantiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.quantile(values, at)) for name, at in QUANTILES.items()} if len(values) else {}


def overall(findings: Sequence[Finding], *, level: float) -> tuple[float | None, Interval | None]:
    """Return the mean over families of the digits gained, each family with one vote, and its interval."""
    with_digits = [one for one in findings if one.digits is not None]
    if not with_digits:
        return None, None
    digits = float(np.mean([one.digits for one in with_digits if one.digits is not None]))
    replicates = np.mean([one.replicates for one in with_digits if one.replicates is not None], axis=0)
    return digits, percentile_interval(replicates, level=level)


def timing(seconds: np.ndarray, rays: int, compile_seconds: tuple[float, float], *, level: float) -> Timing:
    """Return the ratio of the second row of times to the first, (2, repetitions)."""
    # Without any kernel, where all is known before rendering, neither is slower.
    ratios = np.divide(seconds[1], seconds[0], out=np.ones_like(seconds[0]), where=seconds[0] > 0)
    first, second = (float(np.median(row)) / rays * 1e9 for row in seconds)
    return Timing(
        ratio=float(np.median(ratios)),
        interval=median_interval(ratios.tolist(), level=level),
        nanoseconds=(first, second),
        compile_seconds=compile_seconds,
        ratios=ratios,
    )


def overall_timing(timings: Sequence[Timing], *, level: float) -> tuple[float, Interval]:
    """Return the median over repetitions of the families' geometric mean ratio, and its interval."""
    each = np.exp(np.mean(np.log([one.ratios for one in timings]), axis=0))
    return float(np.median(each)), median_interval(each.tolist(), level=level)
