"""The reference cache: the same question gets the same answer, any other and a damaged entry none."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.run import reference_cache
from rayproof.reports.run.cache_store import Store, encode, usual_folder
from rayproof.reports.run.reference_cache import Question, cached
from rayproof.reports.run.worker_tasks import ask_reference
from tests.reports.judge.scenes import ORACLE, SCENE, truth

STAGES = tuple(Stage)


class Counting(Analytic):
    """The analytic reference, counting how often it is asked, with settings that a test may change."""

    def __init__(self) -> None:
        self.asked, self.chosen = 0, {"quality": "1"}

    def settings(self, scene) -> dict[str, str]:
        """Return the settings."""
        return self.chosen

    def renders(self):
        """Return what is to be kept."""
        self.asked += 1
        return ORACLE.render(SCENE, STAGES), np.ones((3, 3, 3))


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    """Return an empty store; whatever took any time is worth keeping."""
    monkeypatch.setattr(reference_cache, "OPENING", 0.0)
    monkeypatch.setattr(reference_cache, "READING", 1e18)
    return Store(tmp_path / "cache")


def ask(reference: Counting, store: Store, *, scene=SCENE, stages=STAGES, samples=1):
    """Ask through the cache."""
    question = Question(name="counting", reference=reference, scene=scene, stages=stages, samples=samples)
    return cached(question, reference.renders, store=store)


def only(store: Store) -> Path:
    """Return the path of the store's only entry."""
    (item,) = store.items()
    return item.path


def test_a_render_is_asked_for_once_and_the_same_to_the_last_bit(store):
    reference = Counting()

    first, second = ask(reference, store), ask(reference, store)

    assert (first.cached, second.cached, reference.asked) == (False, True, 1)
    assert second.mean is not None
    assert np.array_equal(second.mean, np.ones((3, 3, 3)))
    for stage in STAGES:
        images = first.answers[stage], second.answers[stage]
        if stage is Stage.CAMERA:
            assert images[0].keys() == images[1].keys()
            assert all(np.array_equal(images[0][part], images[1][part]) for part in images[0])
        else:
            assert images[0].tobytes() == images[1].tobytes()


def test_anything_that_an_answer_depends_on_makes_another_question(store, monkeypatch):
    reference = Counting()
    ask(reference, store)

    brighter = replace(SCENE, lights=(replace(SCENE.lights[0], flux=(1.0, 2.0, 3.0)),))
    assert not ask(reference, store, scene=brighter).cached
    assert not ask(reference, store, stages=STAGES[:3]).cached
    assert not ask(reference, store, samples=2).cached
    reference.chosen = {"quality": "2"}
    assert not ask(reference, store).cached
    monkeypatch.setattr(Counting, "version", lambda self: "another")
    assert not ask(reference, store).cached
    monkeypatch.setattr(reference_cache, "code", lambda: "other code")
    assert not ask(reference, store).cached
    assert ask(reference, store).cached


@pytest.mark.parametrize("harm", ["altered", "cut short", "emptied", "another's"])
def test_a_damaged_entry_is_rendered_anew_and_told_of(store, harm):
    reference = Counting()
    ask(reference, store)
    path = only(store)
    data = path.read_bytes()
    path.write_bytes(
        {
            "altered": data[:-9] + b"\x01" + data[-8:],
            "cut short": data[: len(data) // 2],
            "emptied": b"",
            "another's": encode({"key": "0" * 64}, {"a": np.zeros(3)}, question="0" * 64),
        }[harm]
    )

    again = ask(reference, store)

    assert not again.cached
    assert reference.asked == 2
    assert "damaged" in again.notes[0]
    third = ask(reference, store)
    assert (third.cached, third.notes) == (True, ())


def test_what_costs_less_to_render_than_to_read_is_not_kept(tmp_path):
    reference, store = Counting(), Store(tmp_path)
    nothing = lambda: ({Stage.RAY: np.zeros((200, 200, 3))}, None)  # noqa: E731

    question = Question(name="counting", reference=reference, scene=SCENE, stages=(Stage.RAY,), samples=1)
    found = cached(question, nothing, store=store)

    assert not found.cached
    assert store.items() == []


def test_a_cache_that_cannot_be_written_costs_a_note_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(reference_cache, "OPENING", -1.0)
    monkeypatch.setattr(reference_cache, "READING", 1e18)
    (tmp_path / "file").write_text("not a folder")

    found = ask(Counting(), Store(tmp_path / "file"))

    assert set(found.answers) == set(STAGES)
    assert "could not be kept" in found.notes[0]


def test_a_reference_is_heard_from_the_cache_only_where_its_task_says_so(tmp_path, monkeypatch):
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path))
    assert usual_folder() == tmp_path
    monkeypatch.setattr(reference_cache, "OPENING", -1.0)
    monkeypatch.setattr(reference_cache, "READING", 1e18)
    ask_reference("analytic", Analytic(), SCENE, independent=True)
    assert not Store(tmp_path).items(), "a renderer under test is asked without the cache"
    first, second = (ask_reference("analytic", Analytic(), SCENE, cached=True, independent=True) for _ in range(2))

    assert (first.cached, second.cached) == (False, True)
    assert np.array_equal(second.answers[Stage.RADIANCE], truth()[Stage.RADIANCE])


def test_a_listing_tells_what_is_there(store):
    ask(Counting(), store)

    (item,) = store.items()

    assert item.about["reference"] == "counting"
    assert item.about["settings"] == {"quality": "1"}
    assert json.dumps(item.about)
