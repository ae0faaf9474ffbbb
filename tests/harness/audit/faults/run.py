"""Planted faults of the runner and its ledgers."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from rayproof.reports.judge.limit_sentinels import SCENE
from rayproof.reports.results import outcomes
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run import cache_store, plan, reference_cache, verdict_memory
from rayproof.reports.run.workload import Journal
from tests.harness.audit.faults import FAULTS, altered, replaced
from tests.harness.guards.keys import CASE


@FAULTS.register("run/any_journal_entry", where="run", stage=None)
@contextmanager
def any_journal_entry() -> Iterator[None]:
    """Return the first record for any key.

    The journal hands out whatever result it has.
    """

    def wrong(journal: Any, key: str) -> Any:
        return next((record for _, record in journal._table.salvaged()), None)

    with altered(Journal, "finished", wrong):
        yield


@FAULTS.register("run/best_for_worst", where="run", stage=None)
@contextmanager
def best_for_worst() -> Iterator[None]:
    """Take the best outcome for the worst.

    A case takes the best verdict of its checks.
    """
    right = outcomes.worst

    def wrong(found: Any) -> Any:
        return min(found, key=list(outcomes.Outcome).index, default=outcomes.Outcome.MISSING)

    with replaced(right, wrong):
        yield


# The reference cache takes one render for another: of another scene, camera, version or settings.
@contextmanager
def _key_is(wrong: Callable[[Any], Any]) -> Iterator[None]:
    """Change every key of a render."""
    right = reference_cache.ReferenceQuestion.key.func
    with altered(reference_cache.ReferenceQuestion, "key", property(lambda question: wrong(right(question)))):
        yield


@FAULTS.register("run/cache_any_scene", where="run", stage=None)
def cache_any_scene() -> Any:
    """Leave the scene's light, surfaces and camera out of the key."""
    return _key_is(lambda key: replace(key, scene=SCENE))


@FAULTS.register("run/cache_any_camera", where="run", stage=None)
def cache_any_camera() -> Any:
    """Leave the camera out of the key."""
    return _key_is(lambda key: replace(key, scene=replace(key.scene, camera=SCENE.camera)))


@FAULTS.register("run/cache_any_version", where="run", stage=None)
def cache_any_version() -> Any:
    """Leave version and settings out of the key."""
    return _key_is(lambda key: replace(key, version="", settings={}))


@FAULTS.register("run/cache_believes_damage", where="run", stage=None)
@contextmanager
def cache_believes_damage() -> Iterator[None]:
    """Check nothing.

    The reference cache believes an entry whatever its checksum says.
    """

    def wrong(data: Any, question: str) -> None:
        return None

    with replaced(cache_store._check, wrong):
        yield


@FAULTS.register("run/code_by_hand", where="run", stage=None)
@contextmanager
def code_by_hand() -> Iterator[None]:
    """Take the reports' sources for all that decide an answer.

    A key goes by the code that somebody listed, and not by that of cases and references.
    """
    right = reference_cache.sources

    def wrong(*, tracer: bool) -> list[Path]:
        return [file for file in right(tracer=tracer) if "reports" in file.parts]

    with replaced(right, wrong):
        yield


@FAULTS.register("run/exit_code_zero", where="run", stage=None)
@contextmanager
def exit_code_zero() -> Iterator[None]:
    """Exit with 0, whatever was found.

    The exit code says that all is well.
    """
    right = outcomes.exit_code

    def wrong(found: Any) -> int:
        return 0

    with replaced(right, wrong):
        yield


@FAULTS.register("run/lost_check_not_noticed", where="run", stage=None)
@contextmanager
def lost_check_not_noticed() -> Iterator[None]:
    """Plan as many as were found.

    A ledger adds up whatever was planned.
    """
    right = outcomes.ledger

    def wrong(found: Any, *, planned: int) -> dict[str, int]:
        found = list(found)
        return right(found, planned=len(found))

    with replaced(right, wrong):
        yield


@FAULTS.register("run/skipped_counts_as_pass", where="run", stage=None)
@contextmanager
def skipped_counts_as_pass() -> Iterator[None]:
    """Count what has no outcome as passed.

    A skipped case is counted as passed.
    """
    right = outcomes.ledger

    def wrong(found: Any, *, planned: int) -> dict[str, int]:
        found = [Outcome.PASS if one is Outcome.MISSING else one for one in found]
        return right(found + [Outcome.PASS] * (planned - len(found)), planned=planned)

    with replaced(right, wrong):
        yield


# A kept record is taken up again whatever changed, or whatever code it was found by.
@FAULTS.register("run/stale_result", where="run", stage=None)
@contextmanager
def stale_result() -> Iterator[None]:
    """Give every case the same key."""
    right = plan.record_key

    def wrong(planned: Any, demands: Any) -> Any:
        return right(replace(planned, case=CASE), demands)

    with replaced(right, wrong):
        yield


@FAULTS.register("run/stale_code", where="run", stage=None)
@contextmanager
def stale_code() -> Iterator[None]:
    """Leave the code out of the key."""
    right = plan.record_key

    def wrong(planned: Any, demands: Any) -> Any:
        return replace(right(planned, demands), code="")

    with replaced(right, wrong):
        yield


@FAULTS.register("run/unmeasured_passes", where="run", stage=None)
@contextmanager
def unmeasured_passes() -> Iterator[None]:
    """Call the worst of nothing a pass.

    A case in which nothing was measured passes.
    """
    right = outcomes.worst

    def wrong(found: Any) -> Outcome:
        found = list(found)
        return right(found) if found else Outcome.PASS

    with replaced(right, wrong):
        yield


# A verdict found before is said again of what it was not found of, each by something left out.
@contextmanager
def _without(**left_out: Any) -> Iterator[None]:
    """Give some fields of the key always the same value; of candidates, the fields named."""
    right, of_subjects = verdict_memory.judgement_key, left_out.pop("subjects", None)

    def wrong(*about: Any) -> Any:
        key = replace(right(*about), **left_out)
        if of_subjects is None:
            return key
        return replace(key, subjects=tuple(replace(answers, **of_subjects) for answers in key.subjects))

    with replaced(right, wrong):
        yield


@FAULTS.register("run/verdict_of_any_answer", where="run", stage=None)
def verdict_of_any_answer() -> Any:
    """Leave the answers out of the key."""
    return _without(subjects={"answers": {}})


@FAULTS.register("run/verdict_of_any_configuration", where="run", stage=None)
def verdict_of_any_configuration() -> Any:
    """Leave the configurations' names out of the key."""
    return _without(subjects={"name": ""})


@FAULTS.register("run/verdict_before_any_reference", where="run", stage=None)
def verdict_before_any_reference() -> Any:
    """Leave the references' versions out of the key."""
    return _without(versions={})
