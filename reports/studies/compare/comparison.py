"""`compare`: both contenders on the same scenes, with paired errors, interleaved times and an A/A control."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.results.files import SCHEMA
from rayproof.reports.results.provenance import origin
from rayproof.reports.studies.compare.contenders import Contender, SceneFamily, differing, stages_at_stake
from rayproof.reports.studies.compare.findings import (
    FamilyDifference,
    Signs,
    Timing,
    accuracy,
    finding,
    outcome,
    overall,
    overall_timing,
    sentence,
    speed,
    timing,
)
from rayproof.reports.studies.compare.paired_errors import Job, PairedStage, interleaved, needed, paired, shown
from rayproof.reports.studies.compare.records import (
    FamilyRecord,
    FormulaComparisonRecord,
    SideRecord,
)
from rayproof.reports.studies.compare.statistics import FEWEST, LEVEL, Interval, shared, too_few

SEED = 4
BASE, CANDIDATE, AGAIN = 0, 1, 2  # indices of the timed configurations; AGAIN is the base, as the control


def family_record(finding: FamilyDifference, timing: Timing, signs: Signs, outcome: str) -> FamilyRecord:
    """Return the record of one family."""
    return {
        "family": finding.family,
        "stress": finding.stress,
        "outcome": outcome,
        "changed": asdict(signs),
        "scenes": finding.scenes,
        "pixels": finding.pixels,
        "same_inputs": finding.same_inputs,
        "digits_gained": finding.digits,
        "digits_interval": finding.digits_interval,
        "share_better": finding.better,
        "share_worse": finding.worse,
        "wrong": {
            "base": finding.only_base + finding.both_wrong,
            "candidate": finding.only_candidate + finding.both_wrong,
            "only_base": finding.only_base,
            "only_candidate": finding.only_candidate,
            "p": finding.p,
        },
        "tail": asdict(finding.tail),
        "errors": {
            stage: {"base": asdict(base), "candidate": asdict(candidate)}
            for stage, (base, candidate) in finding.errors.items()
        },
        "time_ratio": timing.ratio,
        "time_interval": timing.interval,
        "nanoseconds_per_ray": timing.nanoseconds,
        "compile_seconds": timing.compile_seconds,
    }


@dataclass(frozen=True, kw_only=True)
class _Side:
    """The comparison of the candidate, or of the control, with the base: one entry per family."""

    findings: list[FamilyDifference]
    timings: list[Timing]


def compare(
    families: Sequence[SceneFamily],
    base: Contender,
    candidate: Contender,
    *,
    repetitions: int,
    tell: Callable[[str], None] = lambda _: None,
) -> FormulaComparisonRecord:
    """Return the comparison as docs/compare.md describes it; `tell` receives progress messages.

    Raises:
        LookupError: no pixel of the `families` depends on the differing formulas.
        ValueError: there are fewer repetitions than an interval needs.

    """
    if repetitions < FEWEST:
        raise ValueError(too_few(repetitions))
    stages = stages_at_stake(base.configuration, candidate.configuration)
    slots = differing(base.configuration, candidate.configuration)
    results: list[tuple[SceneFamily, list[list[dict[Stage, PairedStage]]]]] = []
    for number, question in enumerate(families):
        tell(f"{question.family} ({number + 1} of {len(families)})")
        pairs = [
            paired(scene, stages, base, (candidate, base), slots=slots, seed=SEED + index)
            for index, (_, scene) in enumerate(question.scenes)
        ]
        if any(pair.pixels for scene in pairs for pair in scene[0].values()):
            results.append((question, [[scene[side] for scene in pairs] for side in (0, 1)]))
    if not results:
        raise LookupError(f"no pixel of these families shows what differs between {base.label} and {candidate.label}")
    tell(f"timing {len(results)} families, {repetitions} repetitions")
    level = shared(LEVEL, len(results))
    timings = _timings(
        [(question, sides[0]) for question, sides in results], stages, base, candidate, repetitions, level
    )
    sides = [
        _Side(
            findings=[
                finding(question.family, question.stress, family_pairs[index], level=level, seed=SEED)
                for question, family_pairs in results
            ],
            timings=timings[index],
        )
        for index in (0, 1)
    ]
    return _assembled(sides[0], sides[1], base, candidate, stages, repetitions)


def _timings(
    families: Sequence[tuple[SceneFamily, Sequence[dict[Stage, PairedStage]]]],
    stages: tuple[Stage, ...],
    base: Contender,
    candidate: Contender,
    repetitions: int,
    level: float,
) -> tuple[list[Timing], list[Timing]]:
    """Return each family's timing of the candidate and of the control, on its scene with the most counted pixels."""
    configurations = (base.configuration, candidate.configuration, base.configuration)
    jobs = []
    for question, pairs in families:
        shares = [sum(pair.pixels for pair in scene.values()) for scene in pairs]
        scene = question.scenes[int(np.argmax(shares))][1]
        jobs.append(Job(scene=scene, stages=needed(shown(scene, stages))[-1:], configurations=configurations))
    times = interleaved(jobs, repetitions=repetitions, generator=np.random.default_rng(SEED))

    def side(index: int) -> list[Timing]:
        return [
            timing(
                launch_times.seconds[[BASE, index]],
                launch_times.rays,
                (launch_times.compile_seconds[BASE], launch_times.compile_seconds[index]),
                level=level,
            )
            for launch_times in times
        ]

    return side(CANDIDATE), side(AGAIN)


def _assembled(
    side: _Side, control: _Side, base: Contender, candidate: Contender, stages: tuple[Stage, ...], repetitions: int
) -> FormulaComparisonRecord:
    _, control_interval = overall_timing(control.timings, level=LEVEL)
    outside = sum(not timing.interval[0] <= 1.0 <= timing.interval[1] for timing in control.timings)
    return {
        "schema": SCHEMA,
        "origin": origin(SEED),
        "base": base.label,
        "candidate": candidate.label,
        "configurations": [base.configuration.name, candidate.configuration.name],
        "faults": sorted({*base.configuration.faults, *candidate.configuration.faults}),
        "stages": [stage.value for stage in stages],
        "level": LEVEL,
        "repetitions": repetitions,
        **_said(side, base.label, candidate.label, control.timings, control_interval),
        "control": {
            **_said(control, base.label, f"{base.label} again", control.timings, control_interval),
            "families_outside": outside,
        },
    }


def _said(side: _Side, base: str, candidate: str, controls: Sequence[Timing], control_interval: Interval) -> SideRecord:
    """Return the verdict, digits gained, time ratio and families of one side."""
    alpha = 1 - shared(LEVEL, len(side.findings))
    accuracies = [accuracy(row, alpha=alpha) for row in side.findings]
    digits, digits_interval = overall(side.findings, level=LEVEL)
    ratio, interval = overall_timing(side.timings, level=LEVEL)
    paces = [speed(row.interval, beside.interval) for row, beside in zip(side.timings, controls, strict=True)]
    families = zip(side.findings, side.timings, accuracies, paces, strict=True)
    return {
        "verdict": sentence(
            base,
            candidate,
            side.findings,
            accuracies,
            paces=paces,
            time_ratio=ratio,
            time_interval=interval,
            control_interval=control_interval,
        ),
        "outcome": outcome(accuracies, speed(interval, control_interval), *paces),
        "digits_gained": digits,
        "digits_interval": digits_interval,
        "time_ratio": ratio,
        "time_interval": interval,
        "families": [family_record(row, time, signs, outcome([signs], pace)) for row, time, signs, pace in families],
    }
