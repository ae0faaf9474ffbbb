"""Planted fault: every suspect reference is explained by a finding that does not exist."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import findings


@FAULTS.register("judge/everything_known", where="judge", stage=None)
@contextmanager
def everything_known() -> Iterator[None]:
    """Know a finding for everything."""
    right = findings.explained

    def wrong(reference: str, version: str, stage: Any, *_: Any) -> Any:
        return findings.KnownFinding(
            name="nothing",
            reference=reference,
            version=version,
            stage=stage,
            where="",
            at_least=0.0,
            smallest_scene="none.json",
            command="none",
            third_witness="nobody",
            what="nothing",
        )

    with replaced(right, wrong):
        yield
