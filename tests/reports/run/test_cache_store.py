"""The store: it never grows too large, whoever writes at once, and what it may not remove costs nothing."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rayproof.reports.run import cache_store
from rayproof.reports.run.cache_store import DamagedEntryError, Store, encode

ARRAY = {"a": np.full(1000, 0.1)}
SIZE = len(encode({"key": "k" * 64}, ARRAY, question="k" * 64))


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
