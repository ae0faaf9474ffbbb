"""A small benchmark."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from rayproof.cases import benchmark_scenes
from tests.benchmarks.bench import apart
from tests.benchmarks.bench.__main__ import bench
from tests.command_line import call


@pytest.mark.process
def test_a_small_benchmark_writes_what_its_document_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark_scenes, "QUICK_SIZES", ((64, 48),))
    monkeypatch.setattr("tests.benchmarks.bench.__main__.QUICK_BUDGET", 0.05)
    file, again = tmp_path / "one.json", tmp_path / "two.json"

    assert call(bench, ["sphere_and_floor", "--quick", "--json", str(file)]) == 0
    assert call(bench, ["sphere_and_floor", "--quick", "--compare", str(file), "--json", str(again)]) == 0

    document = json.loads(file.read_text())
    (entry,) = document["scenes"]
    assert (entry["name"], entry["width"], entry["height"]) == ("sphere_and_floor", 64, 48)
    assert entry["ours_ms"] > 0
    assert entry["minimal_ms"] > 0
    assert entry["direct_ms"] > 0
    low, high = entry["ratio_minimal_interval"]
    assert low <= entry["ratio_minimal"] <= high
    # Outlines and shadow edges in float32: never more than their own pixels.
    assert entry["pixels_differ"] < 0.01
    assert entry["error"]["median"] < 1e-5
    assert document["machine"]["fma_gflops"] > 0
    assert entry["limit_fraction"] > 0
    (change,) = json.loads(again.read_text())["changes"]
    assert change["verdict"] in ("slower", "faster", "no difference shown")
    assert "sphere_and_floor" in capsys.readouterr().out


def test_a_scene_on_which_somebody_dies_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def dies(tasks: Sequence[apart.Task]) -> Iterator[apart.BenchError]:
        yield from (apart.BenchError(f"{task.scene}: the worker died") for task in tasks)

    monkeypatch.setattr(apart, "timed_apart", dies)

    assert call(bench, ["sphere_and_floor", "--quick"]) == 1
    assert "error: sphere_and_floor: the worker died" in capsys.readouterr().out
