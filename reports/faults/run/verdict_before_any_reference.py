"""Planted fault: a verdict found before other references, or other versions of them, is said again."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from reports.cache import judgements
from reports.faults import FAULTS
from reports.faults.patching import altered


@FAULTS.register("run/verdict_before_any_reference", where="run", stage=None)
@contextmanager
def verdict_before_any_reference() -> Iterator[None]:
    """Leave the references' versions out of the question."""
    right = judgements.question

    def wrong(case: Any, candidates: Sequence[Any], versions: Mapping[str, str], asked: Any, *, files: str) -> str:
        return right(case, candidates, {}, asked, files=files)

    with altered(judgements, "question", wrong):
        yield
