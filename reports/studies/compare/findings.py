"""`FamilyDifference` and `Timing`: errors, quantiles, intervals and the verdict, per family and over all families."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.studies.compare.paired_errors import UNITS, PairedStage
from rayproof.reports.studies.compare.statistics import (
    Interval,
    Tail,
    mcnemar,
    median_interval,
    percentile_interval,
    scene_means,
)

# A change of the error by less than a twentieth is not reported, even if it is significant.
LEAST_DIGITS = math.log10(1.05)
QUANTILES = {"median": 0.5, "p99": 0.99, "worst": 1.0}


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Quantiles of one contender's errors in one family, over the pixels that it decides rightly."""

    scaled: dict[str, float]  # error / (K u): median, p99, worst
    natural: dict[str, float]
    unit: str


@dataclass(frozen=True, kw_only=True)
class FamilyDifference:
    """The difference between two contenders in a family; None for a number that a stage lacks, as digits of a mask."""

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
    ratios: np.ndarray  # one per repetition


def finding(
    family: str, stress: bool, scenes: Sequence[Mapping[Stage, PairedStage]], *, level: float, seed: int
) -> FamilyDifference:
    """Return the difference in one family; scenes without counted pixels are left out."""
    pairs = [(stage, pair) for scene in scenes for stage, pair in scene.items() if pair.pixels]
    generator = np.random.default_rng(seed)
    per_scene = [[pair for pair in scene.values() if len(pair.replicates)] for scene in scenes]
    per_scene = [stage_pairs for stage_pairs in per_scene if stage_pairs]
    digits = interval = replicates = None
    if per_scene:
        digits = float(np.mean([np.mean([pair.digits for pair in stage_pairs]) for stage_pairs in per_scene]))
        scenes_drawn = np.array(
            [np.mean([pair.replicates for pair in stage_pairs], axis=0) for stage_pairs in per_scene]
        )
        replicates = scene_means(scenes_drawn, generator)
        interval = percentile_interval(replicates, level=level)
    only_base, only_candidate = (
        sum(getattr(pair, name) for _, pair in pairs) for name in ("only_base", "only_candidate")
    )
    return FamilyDifference(
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
        sides = [getattr(pair, name) for pair in pairs]
        scaled, natural = (
            np.concatenate([getattr(side, kind)[np.isfinite(getattr(side, kind))] for side in sides])
            for kind in ("scaled", "natural")
        )
        return Errors(scaled=_quantiles(scaled), natural=_quantiles(natural), unit=UNITS[stage])

    return of("base"), of("candidate")


def _quantiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.quantile(values, at)) for name, at in QUANTILES.items()} if len(values) else {}


def overall(findings: Sequence[FamilyDifference], *, level: float) -> tuple[float | None, Interval | None]:
    """Return the mean over families of the digits gained, each family with one vote, and its interval."""
    with_digits = [finding for finding in findings if finding.digits is not None]
    if not with_digits:
        return None, None
    digits = float(np.mean([finding.digits for finding in with_digits if finding.digits is not None]))
    replicates = np.mean([finding.replicates for finding in with_digits if finding.replicates is not None], axis=0)
    return digits, percentile_interval(replicates, level=level)


def timing(seconds: np.ndarray, rays: int, compile_seconds: tuple[float, float], *, level: float) -> Timing:
    """Return the ratio of the second row of times to the first, (2, repetitions)."""
    # If the image is constant there is no kernel to time; the ratio is then 1.
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
    means = np.exp(np.mean(np.log([timing.ratios for timing in timings]), axis=0))
    return float(np.median(means)), median_interval(means.tolist(), level=level)


# The outcome (better, worse, mixed, no difference shown) and the verdict of findings.


BETTER, WORSE, MIXED, NOTHING = "better", "worse", "mixed", "no difference shown"
MOST_NAMED = 4  # families in the verdict; the table has all


@dataclass(frozen=True, kw_only=True)
class Signs:
    """The significant changes in a family: 1 if better, -1 if worse, 0 if neither is significant."""

    decisions: int
    typical: int
    tail: int

    @property
    def all(self) -> frozenset[int]:
        """Return the set of significant signs; it has two elements if decisions, typical pixel and tail disagree."""
        return frozenset({self.decisions, self.typical, self.tail} - {0})


def accuracy(finding: FamilyDifference, *, alpha: float) -> Signs:
    """Return the significant changes in a family at the significance level `alpha`."""
    decisions = 1 if finding.only_base > finding.only_candidate else -1
    return Signs(
        decisions=decisions if finding.p < alpha else 0,
        typical=_typical(finding),
        tail=finding.tail.sign if finding.tail.p < alpha else 0,
    )


def _typical(finding: FamilyDifference) -> int:
    if finding.digits is None or finding.digits_interval is None or abs(finding.digits) < LEAST_DIGITS:
        return 0
    low, high = finding.digits_interval
    return 1 if low > 0 else -1 if high < 0 else 0


def speed(interval: Interval, control: Interval) -> int:
    """Return 1 if the candidate is significantly faster, -1 if slower; 0 within the interval of the A/A control."""
    if interval[0] > max(1.0, control[1]):
        return -1
    return 1 if interval[1] < min(1.0, control[0]) else 0


def outcome(accuracies: Sequence[Signs], *paces: int) -> str:
    """Return the outcome over all families, from the signs of their errors and of their run times."""
    signs = frozenset(paces).union(*(signs_of_family.all for signs_of_family in accuracies)) - {0}
    if len(signs) > 1:
        return MIXED
    return {1: BETTER, -1: WORSE}[min(signs)] if signs else NOTHING


def sentence(
    base: str,
    candidate: str,
    findings: Sequence[FamilyDifference],
    accuracies: Sequence[Signs],
    *,
    paces: Sequence[int],
    time_ratio: float,
    time_interval: Interval,
    control_interval: Interval,
) -> str:
    """Return the verdict: the families with larger and with smaller errors, the changes there, and the time ratio.

    `paces` are 1 for a family that takes significantly less time, -1 for one with significantly more.
    """
    fast = speed(time_interval, control_interval)
    word = outcome(accuracies, fast, *paces)
    parts = []
    for wanted, how in (({-1}, "errs more"), ({1, -1}, "errs more in one way, less in another"), ({1}, "errs less")):
        chosen = [(family, signs) for family, signs in zip(findings, accuracies, strict=True) if signs.all == wanted]
        if chosen:
            parts.append(f"{candidate} {how} than {base} on {_named(chosen)}")
    if not parts:
        many = "1 family" if len(findings) == 1 else f"{len(findings)} families"
        parts = [f"no difference in error shown between {base} and {candidate} on {many}{_unproven(findings)}"]
    ratio = f"{time_ratio:.3f} [{time_interval[0]:.3f}, {time_interval[1]:.3f}]"
    beside = f"control [{control_interval[0]:.3f}, {control_interval[1]:.3f}]"
    pace = {1: "it is faster", -1: "it is slower", 0: "no difference in run time shown"}[fast]
    apart = [family.family for family, sign in zip(findings, paces, strict=True) if sign not in (0, fast)]
    if apart:
        pace += f", though not on {_some(apart)}" if fast else f" over all, only on {_some(apart)}"
    return f"{word[0].upper()}{word[1:]}: {'; '.join(parts)}; {pace}, time ratio {ratio} ({beside})."


def _unproven(findings: Sequence[FamilyDifference]) -> str:
    """Return the tail's counts of pixels in words, for a tail that is not significant; empty without such pixels."""
    worse, better = (sum(getattr(finding.tail, name) for finding in findings) for name in ("worse", "better"))
    if not worse and not better:
        return ""
    tiles = sum(finding.tail.tiles_worse + finding.tail.tiles_better for finding in findings)
    where = "1 tile" if tiles == 1 else f"{tiles} tiles"
    return f" (tail: worse on {worse} pixels, better on {better}, in {where}: not enough to tell)"


def _named(chosen: Sequence[tuple[FamilyDifference, Signs]]) -> str:
    """Return the families and their changes, those with the largest difference first."""
    ordered = sorted(chosen, key=lambda entry: (-abs(entry[0].digits or 0.0), -_share(entry[0])))
    return _some([f"{family.family} ({'; '.join(_facts(family, signs))})" for family, signs in ordered])


def _some(names: Sequence[str]) -> str:
    """Return the first names, and the number of the names left out."""
    return ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")


def _share(finding: FamilyDifference) -> float:
    """Return the absolute difference between the shares of pixels in the tail that are worse and better."""
    return abs(finding.tail.worse - finding.tail.better) / max(1, finding.pixels)


def _facts(family: FamilyDifference, signs: Signs) -> list[str]:
    """Return the changes in a family: of the typical pixel, of the tail, of the decisions."""
    facts = []
    if signs.typical and family.digits is not None and family.digits_interval is not None:
        low, high = family.digits_interval
        facts.append(f"typical pixel {family.digits:+.2f} digits [{low:.2f}, {high:.2f}]")
    if signs.tail:
        worse, better = (f"{100 * count / family.pixels:.3g} %" for count in (family.tail.worse, family.tail.better))
        shares = f"worse on {worse} of pixels, better on {better}"
        facts.append(", ".join([f"tail: {shares}", *_p99(family)]))
    if family.only_base or family.only_candidate:
        facts.append(
            f"wrong pixels {family.only_base + family.both_wrong} -> {family.only_candidate + family.both_wrong}"
        )
    return facts


def _p99(family: FamilyDifference) -> list[str]:
    """Return the p99 errors of both contenders in the first two stages where both have errors."""
    changes = [
        f"p99 error {base.natural['p99']:.2g} -> {candidate.natural['p99']:.2g} {base.unit}".rstrip()
        for base, candidate in family.errors.values()
        if base.natural and candidate.natural
    ]
    return changes[:2]
