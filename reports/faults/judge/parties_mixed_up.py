"""Planted faults: a reference is not compared or not missed, or all are judged by the first one's answers."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import judging, parties


@FAULTS.register("judge/reference_not_compared", where="judge", stage=None)
@contextmanager
def reference_not_compared() -> Iterator[None]:
    """Leave out one of the references, and plan nothing of it."""
    right = judging.judge_case

    def wrong(case: Any, candidates: Any, witnesses: Any, *rest: Any, **options: Any) -> Any:
        heard = [witness for witness in witnesses if witness.name != "mitsuba_llvm"]
        return right(case, candidates, heard, *rest, **options)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/lost_reference_not_missed", where="judge", stage=None)
@contextmanager
def lost_reference_not_missed() -> Iterator[None]:
    """Plan what arrived, whoever was announced."""

    def wrong(*_: Any) -> list[Any]:
        return []

    with replaced(parties.lost, wrong):
        yield


@FAULTS.register("judge/first_candidates_answers", where="judge", stage=None)
@contextmanager
def first_candidates_answers() -> Iterator[None]:
    """Judge every candidate by what the first one answered."""
    right = judging.judge_case

    def wrong(case: Any, candidates: Any, *rest: Any, **options: Any) -> Any:
        return right(case, [replace(one, answers=candidates[0].answers) for one in candidates], *rest, **options)

    with replaced(right, wrong):
        yield
