"""A finding as plain data for JSON."""

from rayproof.reports.studies.compare.findings import Errors, Finding, Timing
from rayproof.reports.studies.compare.records import ErrorsRecord, FamilyRecord, TailRecord
from rayproof.reports.studies.compare.tails import Tail
from rayproof.reports.studies.compare.verdicts import Signs


def family_record(finding: Finding, timing: Timing, signs: Signs, outcome: str) -> FamilyRecord:
    """Return one family's entry."""
    return {
        "family": finding.family,
        "stress": finding.stress,
        "outcome": outcome,
        "changed": {"decisions": signs.decisions, "typical": signs.typical, "tail": signs.tail},
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
        "tail": _tail(finding.tail),
        "errors": {
            stage: {"base": _errors(base), "candidate": _errors(candidate)}
            for stage, (base, candidate) in finding.errors.items()
        },
        "time_ratio": timing.ratio,
        "time_interval": timing.interval,
        "nanoseconds_per_ray": timing.nanoseconds,
        "compile_seconds": timing.compile_seconds,
    }


def _tail(tail: Tail) -> TailRecord:
    return {
        "better": tail.better,
        "worse": tail.worse,
        "tiles_better": tail.tiles_better,
        "tiles_worse": tail.tiles_worse,
        "scenes": tail.scenes,
        "p": tail.p,
    }


def _errors(errors: Errors) -> ErrorsRecord:
    return {"scaled": errors.scaled, "natural": errors.natural, "unit": errors.unit}
