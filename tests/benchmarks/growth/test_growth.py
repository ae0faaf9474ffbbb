"""Growth: different scenes, two runs of each suite, and the price of a further case."""

from pathlib import Path

import pytest

from tests.benchmarks.growth.checkouts import Ratio, Round, compared, ratios
from tests.benchmarks.growth.measuring import Cost, Further, GrowthError, SuiteCost, cluster_ratios, marginal


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


@pytest.mark.process
def test_each_checkout_runs_its_own_code(tmp_path: Path) -> None:
    other = checkout(tmp_path / "other", "python/rayproof", OTHER)

    with pytest.raises(GrowthError, match="the other checkout was asked"):
        list(compared(other, ("primitives/plane",), rounds=1))
