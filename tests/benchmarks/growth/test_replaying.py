"""Records of a run, replayed: the process that keeps them is measured, and the report is that of a long run."""

from pathlib import Path

import pytest

from rayproof.reports.results.document import save_results
from tests.benchmarks.growth import replaying
from tests.reports.publish.sample import make_folder

pytestmark = pytest.mark.process


def test_records_are_replayed_under_new_names_and_no_folder_has_many_entries(tmp_path: Path) -> None:
    results = make_folder(tmp_path / "run")
    for case in results["cases"]:
        case |= {"planned": len(case["checks"]), "ran": {}}
    save_results(tmp_path / "run", results)

    rows = list(replaying.replayed(tmp_path / "run", [2, 600], folder=tmp_path))

    assert [row["cases"] for row in rows] == [2, 600]
    assert min(row["parent_peak_bytes"] for row in rows) > 2**20
    assert rows[1]["entries"] <= 1000
    assert replaying.ratios(rows)["parent_peak"] == rows[1]["parent_peak_bytes"] / rows[0]["parent_peak_bytes"]
    assert not list(tmp_path.glob("rayproof-replay-*"))
