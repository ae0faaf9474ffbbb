"""Guards let an honest harness pass and stop a broken one."""

from dataclasses import dataclass, fields, replace

import pytest

from rayproof.cases.scene import Camera
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.limit_sentinels import BrokenJudgeError
from rayproof.reports.judge.sentinels import stand_guard
from rayproof.reports.run.reference_cache import Key
from tests.harness.audit.faults import FAULTS
from tests.harness.guards import BrokenHarnessError, keys, stand_guards

GUARDED = [
    name
    for name in FAULTS
    if FAULTS.about(name)["where"] in ("loader", "run", "report") or "analytic" in FAULTS.about(name).get("who", ())
]
# The judge's own take a second each; the audit plants them all.
JUDGE = (
    "edges_excused",
    "limit_times_10",
    "nan_passes",
    "stage_not_planned",
    "reference_never_suspect",
    "float64_by_float32",
    "reference_not_compared",
)


@pytest.mark.process
def test_an_honest_harness_passes() -> None:
    stand_guards()


@pytest.mark.process
@pytest.mark.parametrize("name", GUARDED)
def test_what_all_renderers_share_is_guarded(name: str) -> None:
    with FAULTS[name](), pytest.raises(BrokenHarnessError, match=r"(is|are) broken"):
        stand_guards()


@pytest.mark.parametrize("name", JUDGE)
def test_the_judge_is_guarded(name: str) -> None:
    with FAULTS[f"judge/{name}"](), pytest.raises(BrokenJudgeError, match="the judge is broken"):
        stand_guard(Analytic())


@dataclass(frozen=True, kw_only=True)
class _Wider(Camera):
    """A camera with one field more, of a kind that no guard knows how to change."""

    lens: object = None


def test_a_new_field_that_no_guard_changes_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    wider = _Wider(**{field.name: getattr(keys.SCENE.camera, field.name) for field in fields(keys.SCENE.camera)})
    monkeypatch.setattr(keys, "SCENE", replace(keys.SCENE, camera=wider))

    with pytest.raises(BrokenHarnessError, match=r"nobody knows how to change _Wider\.lens"):
        keys.guard_keys()


def test_a_new_kind_of_key_that_no_guard_changes_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Key, "__subclasses__", lambda: [type("NewKey", (), {})])

    with pytest.raises(BrokenHarnessError, match="nobody changes the fields of NewKey"):
        keys.guard_keys()


def test_a_field_that_a_keys_digest_leaves_out_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Key.digest.fget
    blind = property(lambda key: right(replace(key, name="") if type(key).__name__ == "GuardKey" else key))  # type: ignore[misc]
    monkeypatch.setattr(Key, "digest", blind)

    with pytest.raises(BrokenHarnessError, match=r"GuardKey has the same key whatever GuardKey\.name is"):
        keys.guard_keys()


def test_a_machine_without_memory_is_no_broken_harness(monkeypatch: pytest.MonkeyPatch) -> None:
    def starved() -> None:
        raise MemoryError

    monkeypatch.setattr("tests.harness.guards.loader.guard_loader", starved)

    with pytest.raises(MemoryError):
        stand_guards()
