"""A finding as plain data for JSON."""

from dataclasses import asdict
from typing import Any

from rayproof.reports.studies.compare.findings import Finding, Timing
from rayproof.reports.studies.compare.verdicts import Signs


def family_record(finding: Finding, timing: Timing, signs: Signs, outcome: str) -> dict[str, Any]:
    """Return one family's entry; see docs/compare.md."""
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
