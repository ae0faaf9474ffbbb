"""`rayproof cache` lists, verifies and clears."""

import json
from pathlib import Path

import numpy as np

from rayproof.reports.run.cache_store import Store
from tests.reports.commands.conftest import Rayproof


def filled(folder: Path) -> Store:
    """Return a store with two entries."""
    store = Store(folder)
    about = {"kind": "render", "reference": "mitsuba_scalar", "version": "3", "size": [4, 3], "stages": ["ray"]}
    for key in ("a" * 64, "b" * 64):
        store.put(key, about, {"ray": np.ones((3, 4, 3))})
    return store


def test_list_shows_what_is_there(rayproof: Rayproof, tmp_path: Path) -> None:
    filled(tmp_path / "cache")

    ended = rayproof("cache", "list", "--folder", tmp_path / "cache", "--json", tmp_path / "list.json")

    listed = json.loads((tmp_path / "list.json").read_text())
    assert ended.code == 0
    assert "2 entries" in ended.out
    assert [entry["renderer"] for entry in listed["entries"]] == ["mitsuba_scalar"] * 2


def test_verify_names_and_removes_what_is_damaged(rayproof: Rayproof, tmp_path: Path) -> None:
    store = filled(tmp_path)
    path = store.path("a" * 64)
    path.write_bytes(path.read_bytes()[:-1])

    ended = rayproof("cache", "verify", "--folder", tmp_path)

    assert ended.code == 1
    assert f"damaged and removed: {path}" in ended.out
    assert rayproof("cache", "verify", "--folder", tmp_path).code == 0
    assert len(store.items()) == 1


def test_clear_leaves_nothing_and_nothing_else_goes(rayproof: Rayproof, tmp_path: Path) -> None:
    store = filled(tmp_path)
    (tmp_path / "mine.txt").write_text("not an entry")

    ended = rayproof("cache", "clear", "--folder", tmp_path)

    assert ended.code == 0
    assert "2 entries removed" in ended.out
    assert store.items() == []
    assert (tmp_path / "mine.txt").exists()
