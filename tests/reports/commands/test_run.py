"""`rayproof run` hands the suite exactly what was asked for."""

from pathlib import Path

import pytest

from rayproof.reports.run.options import RunOptions
from rayproof.reports.subjects import Subject
from tests.reports.commands.conftest import Rayproof


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[RunOptions]:
    """Run no suite, but return what would have been asked of it."""
    requests: list[RunOptions] = []

    def suite(request: RunOptions, pool: object = None) -> int:
        requests.append(request)
        return 1

    monkeypatch.setattr("rayproof.reports.run.suite.run", suite)
    return requests


@pytest.mark.process
def test_the_options_arrive(rayproof: Rayproof, asked: list[RunOptions], tmp_path: Path) -> None:
    ended = rayproof(
        *("run", "primitives", "transforms/*", "--out", tmp_path / "out", "--resume", "--jobs", 3, "--timeout", 7),
        *("--require", "analytic", "--require", "mitsuba_scalar", "--json", tmp_path / "results.json"),
        *("--configuration", "float64", "--formula", "triangle/signed_areas"),
    )

    assert ended.code == 1
    assert asked == [
        RunOptions(
            selectors=("primitives", "transforms/*"),
            out=tmp_path / "out",
            resume=True,
            require=("analytic", "mitsuba_scalar"),
            jobs=3,
            timeout=7.0,
            configurations=("float64/triangle=signed_areas",),
            json=tmp_path / "results.json",
        )
    ]


def test_another_renderer_is_put_under_test(rayproof: Rayproof, asked: list[RunOptions], tmp_path: Path) -> None:
    rayproof(
        *("run", "primitives", "--out", tmp_path / "out", "--subject", "mitsuba_scalar", "--no-cache"),
        *("--require", "radiance, certified", "--require", "analytic"),
    )

    assert asked[0].subject == Subject(name="mitsuba_scalar", title="mitsuba_scalar")
    assert asked[0].require == ("radiance", "certified", "analytic")
    assert not asked[0].cached


def test_random_scenes_are_named_by_seed_and_number(
    rayproof: Rayproof, asked: list[RunOptions], tmp_path: Path
) -> None:
    rayproof("random", "--count", 3, "--seed", 7, "--out", tmp_path / "out", "--subject", "mitsuba_scalar")

    assert asked[0].selectors == ("random/7/0", "random/7/1", "random/7/2")
    assert asked[0].subject.name == "mitsuba_scalar"


def test_a_limit_of_workers_memory_is_read_from_the_environment(
    rayproof: Rayproof, asked: list[RunOptions], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("run", "primitives", "--out", tmp_path / "out", "--subject", "mitsuba_scalar")
    monkeypatch.setenv("RAYPROOF_WORKER_MEMORY", "1.5")
    assert rayproof(*words).code == 1
    monkeypatch.setenv("RAYPROOF_WORKER_MEMORY", "much")
    ended = rayproof(*words)

    assert asked[0].worker_memory == 1.5 * 2**30
    assert (ended.code, len(asked)) == (2, 1)
    assert ended.error.startswith("rayproof: RAYPROOF_WORKER_MEMORY is a number of GiB")
