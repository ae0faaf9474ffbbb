"""The store: it never grows too large, whoever writes at once, and what it may not remove costs nothing."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from rayproof.reports.run import cache_store
from rayproof.reports.run.cache_store import DamagedEntryError, Store, encode, usual_limit

ARRAY = {"a": np.full(1000, 0.1)}
SIZE = len(encode({"key": "k" * 64}, ARRAY, question="k" * 64))


@pytest.fixture
def read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refuse to remove anything, as a folder does that is only read or another user's."""

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == ".entry":
            raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "unlink", refuse)


def test_the_least_recently_used_go_first(tmp_path):
    size = len(encode({"key": "k" * 64}, ARRAY, question="k" * 64))
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


def test_a_suite_larger_than_the_store_finds_what_has_room(tmp_path):
    keys = [f"{index:064x}" for index in range(110)]
    found = []
    for _ in range(4):
        store = Store(tmp_path, limit=100 * SIZE + SIZE // 2)
        store.begin()
        missed = [key for key in keys if store.get(key) is None and store.put(key, {}, ARRAY) is None]
        found.append(len(keys) - len(missed))

        assert store.left_out == sum(len(encode({"key": key}, ARRAY, question=key)) for key in keys[100:])

    assert found == [0, 100, 100, 100]


def test_what_the_last_two_runs_did_not_use_goes_first(tmp_path):
    old, kept, new = ("a" * 64, "b" * 64, "c" * 64)
    store = Store(tmp_path, limit=2 * SIZE + SIZE // 2)
    store.begin()
    store.put(old, {}, ARRAY)
    store.put(kept, {}, ARRAY)
    store.begin()
    assert store.get(kept) is not None
    store.begin()

    store.put(new, {}, ARRAY)

    assert [store.get(key) is not None for key in (old, kept, new)] == [False, True, True]
    assert store.left_out == 0


def test_what_all_processes_left_out_is_added_up(tmp_path):
    Store(tmp_path, limit=SIZE).begin()
    Store(tmp_path, limit=SIZE).put("a" * 64, {}, ARRAY)

    for key in ("b" * 64, "c" * 64):
        Store(tmp_path, limit=SIZE).put(key, {}, ARRAY)

    assert Store(tmp_path).left_out == 2 * SIZE
    assert Store(tmp_path).clear()[0] == 1
    assert Store(tmp_path).left_out == 0


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "much"])
def test_a_limit_that_is_none_is_refused(text, monkeypatch):
    monkeypatch.setenv("RAYPROOF_CACHE_LIMIT", text)
    with pytest.raises(ValueError, match=f"CACHE_LIMIT must be positive and at most 8.58993e[+]09 GiB, got {text}"):
        usual_limit()


def test_what_another_store_wrote_is_counted_before_a_64th_of_the_limit_is_added(tmp_path):
    array = {"a": np.full(1000, 0.1)}
    size = len(encode({"key": "k" * 64}, array, question="k" * 64))
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


@pytest.mark.usefixtures("read_only")
def test_a_damaged_entry_that_may_not_be_removed_is_a_damaged_entry(tmp_path):
    store = Store(tmp_path)
    store.put("a" * 64, {}, ARRAY)
    path = store.path("a" * 64)
    path.write_bytes(path.read_bytes()[:-1])

    for _ in range(2):
        with pytest.raises(DamagedEntryError):
            store.get("a" * 64)


def test_what_may_not_be_removed_is_passed_over_when_room_is_made(tmp_path, monkeypatch):
    store, unlink = Store(tmp_path, limit=4 * SIZE), Path.unlink
    for age, digit in enumerate("abcd"):
        store.put(digit * 64, {}, ARRAY)
        os.utime(store.path(digit * 64), (1000 + age, 1000 + age))

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path == store.path("a" * 64):
            raise PermissionError(13, "Permission denied", str(path))
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    store.put("e" * 64, {}, ARRAY)

    assert [store.get(digit * 64) is not None for digit in "abcde"] == [True, False, False, True, True]


def test_an_entry_under_another_question_is_not_believed(tmp_path):
    store = Store(tmp_path)
    store.put("a" * 64, {}, ARRAY)
    store.path("b" * 64).parent.mkdir()
    store.path("a" * 64).rename(store.path("b" * 64))

    with pytest.raises(DamagedEntryError, match="checksum"):
        store.get("b" * 64)


@pytest.mark.parametrize(
    "header",
    ["[", "[" * 100_000, "7", "{}", '{"about": 1, "arrays": []}', '{"about": {}, "arrays": 3}',
     '{"about": {}, "arrays": [["a", "O", "O", [1]]]}',
     '{"about": {}, "arrays": [["a", "<f8", "<f8", [9999999999, 9999999999, 99]]]}',
     '{"about": {}, "arrays": [["a", "none", "<f8", [1]]]}', '{"about": {}, "arrays": [[]]}'],
)  # fmt: skip
def test_whatever_cannot_be_read_under_a_good_checksum_is_damage_and_no_traceback(header, tmp_path):
    store, key = Store(tmp_path), "a" * 64
    parts = [len(header).to_bytes(cache_store.COUNT, "little"), header.encode()]
    store.path(key).parent.mkdir(parents=True)
    store.path(key).write_bytes(b"".join([cache_store.MAGIC, cache_store._checksum(parts, key), *parts]))

    with pytest.raises(DamagedEntryError):
        store.get(key)
    assert not store.path(key).exists()


def test_what_a_reader_cannot_make_anything_of_is_damage(tmp_path):
    store = Store(tmp_path)
    store.put("a" * 64, {}, ARRAY)

    with pytest.raises(DamagedEntryError, match="KeyError"):
        store.read("a" * 64, lambda entry: entry[1]["missing"])
    assert store.get("a" * 64) is None


@pytest.mark.parametrize("mode", [0o775, 0o777])
def test_a_folder_that_others_may_write_is_not_used(mode, tmp_path):
    Store(tmp_path).put("a" * 64, {}, ARRAY)
    tmp_path.chmod(mode)

    store = Store(tmp_path)
    store.put("b" * 64, {}, ARRAY)

    assert "others may write the cache" in (store.unused or "")
    assert store.get("a" * 64) is None
    assert not store.path("b" * 64).exists()


def test_what_a_killed_process_began_to_write_goes_after_an_hour(tmp_path):
    for name, age in (("old", 7200.0), ("new", 60.0)):
        draft = tmp_path / "aa" / f"{name}.draft"
        draft.parent.mkdir(exist_ok=True)
        draft.write_bytes(b"half")
        os.utime(draft, (time.time() - age, time.time() - age))

    Store(tmp_path).put("a" * 64, {}, ARRAY)

    assert [path.name for path in tmp_path.glob("*/*.draft")] == ["new.draft"]
