"""Growth: different scenes, two runs of each suite, and the price of a further case."""

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.benchmarks.growth import checkouts, measuring
from tests.benchmarks.growth.__main__ import growth
from tests.benchmarks.growth.checkouts import Ratio, Round, compared, ratios
from tests.benchmarks.growth.measuring import Cost, Further, GrowthError, SuiteCost, cluster_ratios, marginal, measured
from tests.benchmarks.growth.scenes import write_scenes
from tests.command_line import Command, call


def test_no_two_scenes_are_alike_and_the_first_ones_are_the_same(tmp_path: Path) -> None:
    for name, count in (("few", 2), ("many", 5)):
        write_scenes(count, tmp_path / name)
    few, many = ((tmp_path / name).read_text().splitlines() for name in ("few", "many"))

    assert len({*many}) == 5
    assert few == many[:2]


@pytest.mark.process
def test_a_suite_is_run_twice_and_its_figures_are_written(command: Command, tmp_path: Path) -> None:
    ended = command(growth, 1, "--json", tmp_path / "growth.json")

    assert ended.code == 0, ended.out
    rows = json.loads((tmp_path / "growth.json").read_text())["runs"]
    assert [(row["cases"], row["when"]) for row in rows] == [(1, "at first"), (1, "again")]
    assert all(row["processor_seconds"] > row["parent_processor_seconds"] > 0 for row in rows)
    assert all(row["folder_bytes"] > row["index_bytes"] > 0 and row["parent_peak_bytes"] > 2**24 for row in rows)
    assert "A thousand further cases" not in ended.out


def test_the_price_of_a_further_case() -> None:
    small = Cost(seconds=3.0, processor_seconds=4.0, peak_bytes=5, folder_bytes=6)
    large = Cost(seconds=5.0, processor_seconds=8.0, peak_bytes=25, folder_bytes=46)

    (one,) = marginal([SuiteCost(cases=30, when="again", cost=large), SuiteCost(cases=10, when="again", cost=small)])

    assert one == Further(
        when="again", fewer=10, more=30, seconds=0.1, processor_seconds=0.2, peak_bytes=1.0, folder_bytes=2.0
    )


def test_a_cluster_is_held_against_as_many_processes() -> None:
    plain = Cost(seconds=3.0, processor_seconds=4.0, parent_peak_bytes=5, peak_bytes=5, folder_bytes=6)
    ours = Cost(
        seconds=6.0,
        processor_seconds=5.0,
        parent_processor_seconds=1.0,
        parent_peak_bytes=10,
        peak_bytes=9,
        folder_bytes=6,
    )
    rows = [
        SuiteCost(cases=10, when="at first", engine=engine, cost=cost)
        for engine, cost in (("local:2", ours), ("", plain))
    ]

    (one,) = cluster_ratios([*rows, SuiteCost(cases=20, when="at first", cost=plain)])

    assert one == {"cases": 10, "processor": 1.25, "seconds": 2.0, "parent_share": 0.2, "parent_peak": 2.0}


@pytest.mark.process
def test_a_run_that_fails_is_no_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "COMMAND", "import sys; sys.exit('it broke')")

    with pytest.raises(GrowthError, match="ended with 1: it broke"):
        list(measured([1]))


def test_a_measurement_that_is_terminated_ends_its_suite_and_keeps_what_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = []

    def told_to_stop(counts: list[int]) -> Iterator[SuiteCost]:
        try:
            cost = Cost(seconds=1, processor_seconds=1, peak_bytes=1, folder_bytes=1)
            yield SuiteCost(cases=1, when="again", cost=cost)
            os.kill(os.getpid(), signal.SIGTERM)
        except KeyboardInterrupt:
            ended.append(counts)
            raise

    monkeypatch.setattr(measuring, "measured", told_to_stop)

    assert call(growth, ["1", "--json", str(tmp_path / "growth.json")]) == 130
    assert ended == [[1]]
    assert len(json.loads((tmp_path / "growth.json").read_text())["runs"]) == 1


def test_a_suite_without_cases_is_refused(command: Command) -> None:
    ended = command(growth, 0)

    assert ended.code == 2
    assert "at least 1 case, got 0" in ended.error


def _round(number: int, checkout: str, when: str, seconds: float) -> Round:
    cost = Cost(seconds=seconds, processor_seconds=seconds, peak_bytes=1, folder_bytes=1)
    return Round(number=number, checkout=checkout, when=when, cost=cost)


def test_the_ratio_of_two_checkouts_is_taken_within_a_round() -> None:
    rows = [
        _round(number, checkout, "at first", seconds * pace)
        for number, pace in enumerate((1.0, 3.0, 2.0))
        for checkout, seconds in (("here", 11.0), ("against", 10.0))
    ]

    assert ratios(rows) == {"at first": Ratio(1.1, (1.1, 1.1), 3)}


def checkout(folder: Path, holder: str, lines: str) -> Path:
    """Return a checkout whose command does nothing but `lines`, its packages in the folder `holder` of it."""
    package = folder / holder / "reports"
    package.mkdir(parents=True)
    for one in {package, package.parent} - {folder}:
        (one / "__init__.py").touch()
    if holder:
        (folder / "reports").symlink_to(package)
    (package / "cli.py").write_text(f"def main():\n    {lines}\n")
    return folder


OTHER = "return 'the other checkout was asked'"
REPORT = """import pathlib, sys
    out = pathlib.Path(sys.argv[-1])
    out.mkdir()
    (out / "index.html").touch()"""


@pytest.mark.process
def test_each_checkout_runs_its_own_code(tmp_path: Path) -> None:
    other = checkout(tmp_path / "other", "python/rayproof", OTHER)

    with pytest.raises(GrowthError, match="the other checkout was asked"):
        list(compared(other, ("primitives/plane",), rounds=1))


@pytest.mark.process
def test_so_does_one_with_its_packages_at_the_top(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = checkout(tmp_path / "here", "python/rayproof", REPORT)
    monkeypatch.setattr(checkouts, "CHECKOUT", here)

    with pytest.raises(GrowthError, match="the other checkout was asked"):
        list(compared(checkout(tmp_path / "other", "", OTHER), (), rounds=1))


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        pytest.param(("--suite",), "go together", id="against-what"),
        pytest.param(("3", "--suite", "--against", "."), "takes no number of cases, got 3", id="sizes-too"),
        pytest.param(("--scheduler", "tls://127.0.0.1:1"), "--scheduler is local:N here", id="elsewhere"),
        pytest.param(("--scheduler", "local:0"), "local:N starts N workers", id="no-workers"),
        pytest.param(("--suite", "--against", "nowhere"), "nowhere is no checkout of rayproof", id="no-checkout"),
        pytest.param(("--suite", "--against", ".", "--rounds", "2"), "must be odd", id="even"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(
    command: Command, arguments: tuple[str, ...], complaint: str
) -> None:
    ended = command(growth, *arguments)

    assert ended.code == 2
    assert complaint in ended.error
    assert ended.error.count("\n") == 1
