"""Planted faults: a verdict found before is said again of what it was not found of, each by something left out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.cache import judgements
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@contextmanager
def _without(**left_out: Any) -> Iterator[None]:
    """Give some fields of the key always the same value; of candidates, the fields named."""
    right, of_candidates = judgements.judgement_key, left_out.pop("candidates", None)

    def wrong(*about: Any) -> Any:
        key = replace(right(*about), **left_out)
        if of_candidates is None:
            return key
        return replace(key, candidates=tuple(replace(one, **of_candidates) for one in key.candidates))

    with replaced(right, wrong):
        yield


@FAULTS.register("run/verdict_of_any_answer", where="run", stage=None)
def verdict_of_any_answer() -> Any:
    """Leave the answers out of the key."""
    return _without(candidates={"answers": {}})


@FAULTS.register("run/verdict_of_any_configuration", where="run", stage=None)
def verdict_of_any_configuration() -> Any:
    """Leave the configurations' names out of the key."""
    return _without(candidates={"name": ""})


@FAULTS.register("run/verdict_before_any_reference", where="run", stage=None)
def verdict_before_any_reference() -> Any:
    """Leave the references' versions out of the key."""
    return _without(versions={})
