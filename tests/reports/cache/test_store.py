"""The store: it never grows too large, whoever writes at once, and what it may not remove costs nothing."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from reports.cache.entries import DamagedEntryError, encode
from reports.cache.store import Store

ARRAY = {"a": np.full(1000, 0.1)}
SIZE = len(encode({"key": "k" * 64}, ARRAY))


@pytest.fixture
def read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refuse to remove anything, as a folder does that is only read or another user's."""

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == ".entry":
            raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "unlink", refuse)


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
