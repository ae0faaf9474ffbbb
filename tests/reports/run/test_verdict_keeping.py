"""Verdicts kept: what is taken up again is written where a record's files lie, and nowhere else."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.reports.run import verdict_memory
from rayproof.reports.run.cache_store import Store

KEY = "a" * 64
RECORD: dict[str, Any] = {
    "name": "test/kept",
    "verdict": "pass",
    "scene": "scenes/test/kept.json",
    "pixels": "images/test/kept.js",
    "renders": [{"image": None, "error": None, "cached": False}],
    "checks": [],
    "shapes": [],
    "lights": 0,
    "width": 4,
    "height": 3,
    "judge_seconds": 1.0,
}


def kept(folder: Path, record: dict[str, Any]) -> Store:
    """Keep a record with its files and return the store."""
    for name in (record["scene"], record["pixels"]):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
    store = Store(folder / "cache")
    verdict_memory.keep(store, KEY, folder, record)
    return store


def test_a_record_comes_back_with_its_files(tmp_path):
    found = verdict_memory.recall(kept(tmp_path, RECORD), KEY)

    assert found is not None
    assert found.record == RECORD
    found.write(tmp_path / "again")
    for name in (RECORD["scene"], RECORD["pixels"]):
        assert (tmp_path / "again" / name).read_text() == name


ELSEWHERE = ["../outside", "scenes/../../outside", "/outside", "images", "results.json", "pictures/outside.png"]


@pytest.mark.parametrize("name", ELSEWHERE)
def test_an_entry_that_names_a_file_elsewhere_is_not_taken_up(name, tmp_path):
    store = kept(tmp_path, RECORD)
    entry = store.get(KEY)
    assert entry is not None
    about, arrays = entry
    store.put(KEY, about, arrays | {name: np.zeros(3, np.uint8)})

    assert verdict_memory.recall(store, KEY) is None


@pytest.mark.parametrize("name", ["scenes/../outside.json", "elsewhere/kept.json"])
def test_a_record_that_names_a_file_elsewhere_is_not_kept(name, tmp_path):
    store = kept(tmp_path, RECORD | {"scene": name})

    assert store.items() == []
