"""The reference cache: the same question gets the same answer, a damaged entry none, and it never grows too large."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cases.stages import Stage
from reference.analytic import Analytic
from reports.cache import references
from reports.cache.digests import code
from reports.cache.entries import DamagedEntryError, decode, encode
from reports.cache.references import KeepingOracle, Question, cached
from reports.cache.store import Store, usual_folder
from reports.run.asking import heard
from reports.run.orders import ReferenceTask
from tests.reports.judge.scenes import ORACLE, SCENE, truth

ARRAYS = {
    "float32 inside": np.array([[0.1, -0.0], [np.nan, np.inf]], dtype=np.float32).astype(np.float64),
    "float64": np.array([0.1, 1e300, 5e-324]),
    "bool": np.array([[True, False]]),
    "whole": np.arange(6).reshape(2, 3),
    "empty": np.zeros((0, 3)),
}
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
    monkeypatch.setattr(references, "OPENING", 0.0)
    monkeypatch.setattr(references, "READING", 1e18)
    return Store(tmp_path / "cache")


def ask(reference: Counting, store: Store, *, scene=SCENE, stages=STAGES, samples=1):
    """Ask through the cache."""
    question = Question(name="counting", reference=reference, scene=scene, stages=stages, samples=samples)
    return cached(question, reference.renders, store=store)


def only(store: Store) -> Path:
    """Return the path of the store's only entry."""
    (item,) = store.items()
    return item.path


def test_an_entry_comes_back_to_the_last_bit_and_type():
    about, arrays = decode(encode({"key": "a"}, ARRAYS))

    assert about == {"key": "a"}
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert arrays[name].shape == array.shape
        assert arrays[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("place", [0, 20, 60, -1], ids=["magic", "checksum", "header", "array"])
def test_any_byte_altered_is_noticed(place):
    data = bytearray(encode({"key": "a"}, ARRAYS))
    data[place] ^= 1

    with pytest.raises(DamagedEntryError):
        decode(bytes(data))


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
    monkeypatch.setattr(references, "code", lambda places: "other code")
    assert not ask(reference, store).cached
    assert ask(reference, store).cached


def test_code_of_references_and_cases_is_part_of_the_question():
    assert {"cases", "reference"} <= set(references.CODE)
    assert len(code(references.CODE)) == 64


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
            "another's": encode({"key": "0" * 64}, ARRAYS),
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
    monkeypatch.setattr(references, "OPENING", -1.0)
    monkeypatch.setattr(references, "READING", 1e18)
    (tmp_path / "file").write_text("not a folder")

    found = ask(Counting(), Store(tmp_path / "file"))

    assert set(found.answers) == set(STAGES)
    assert "could not be kept" in found.notes[0]


def test_the_least_recently_used_go_first(tmp_path):
    size = len(encode({"key": "k" * 64}, {"a": np.full(1000, 0.1)}))
    store = Store(tmp_path, limit=4 * size)
    keys = [digit * 64 for digit in "abcd"]
    for age, key in enumerate(keys):
        store.put(key, {}, {"a": np.full(1000, 0.1)})
        os.utime(store.path(key), (1000 + age, 1000 + age))

    assert store.get(keys[0]) is not None, "used now, so that b is the oldest"
    store.put("e" * 64, {}, {"a": np.full(1000, 0.1)})

    assert store.get(keys[1]) is None
    assert store.get(keys[0]) is not None
    assert sum(item.size for item in store.items()) <= 4 * size


def test_what_another_store_wrote_is_counted_before_a_64th_of_the_limit_is_added(tmp_path):
    array = {"a": np.full(1000, 0.1)}
    size = len(encode({"key": "k" * 64}, array))
    stores = [Store(tmp_path, limit=128 * size) for _ in range(2)]

    for index in range(201):
        stores[index % 2].put(f"{index:064x}", {}, array)
        if index % 20 == 0:
            assert sum(item.size for item in stores[0].items()) <= (128 + 2 * 2) * size


def test_many_writers_and_readers_at_once_see_whole_entries_only(tmp_path):
    keys = [f"{index:064x}" for index in range(4)]
    array = {"a": np.random.default_rng(0).random((50, 50, 3))}

    def work(number: int) -> int:
        store, seen = Store(tmp_path, limit=10**6), 0
        for turn in range(12):
            key = keys[(number + turn) % 4]
            store.put(key, {}, array)
            seen += store.get(key) is not None
        return seen

    with ThreadPoolExecutor(8) as pool:
        counts = list(pool.map(work, range(8)))

    assert all(counts)
    assert Store(tmp_path).verify()[1] == []


def test_the_oracles_edges_are_kept_too(store):
    class Once(Analytic):
        asked = 0

        def edges(self, scene):
            self.asked += 1
            return super().edges(scene)

    oracle = Once()
    first, second = (KeepingOracle(oracle, store=store).edges(SCENE) for _ in range(2))

    assert oracle.asked == 1
    assert np.array_equal(first.silhouette, second.silhouette)
    assert np.array_equal(first.gap, second.gap)
    assert first.light_ends == second.light_ends == ()


def test_a_reference_is_heard_from_the_cache_only_where_its_task_says_so(tmp_path, monkeypatch):
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path))
    assert usual_folder() == tmp_path
    monkeypatch.setattr(references, "OPENING", -1.0)
    monkeypatch.setattr(references, "READING", 1e18)
    task = ReferenceTask(scene=SCENE, samples=1)

    heard("analytic", Analytic(), task, independent=True)
    assert not Store(tmp_path).items(), "a renderer under test is asked without the cache"
    first, second = (heard("analytic", Analytic(), replace(task, cached=True), independent=True) for _ in range(2))

    assert (first.cached, second.cached) == (False, True)
    assert np.array_equal(second.answers[Stage.RADIANCE], truth()[Stage.RADIANCE])


def test_a_listing_tells_what_is_there(store):
    ask(Counting(), store)

    (item,) = store.items()

    assert item.about["reference"] == "counting"
    assert item.about["settings"] == {"quality": "1"}
    assert json.dumps(item.about)
