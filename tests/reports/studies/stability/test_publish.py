"""A ladder's files are the same bytes whenever the numbers are the same."""

import csv
import json
from pathlib import Path

from rayproof.cases.ladders import all_ladders
from rayproof.reports.studies.stability.figures import publish
from rayproof.reports.studies.stability.survey import plan, survey


def test_files_of_a_ladder(tmp_path: Path) -> None:
    ladder = next(ladder for ladder in all_ladders() if ladder.name == "SPH-FAR")
    planned = plan(["sphere/haines"], ladders=["SPH-FAR"], precisions=["float32"], quick=True)
    folders = [tmp_path / "one", tmp_path / "two"]

    for folder in folders:
        folder.mkdir()
        publish(folder, ladder, list(survey(planned, doubts=lambda doubt: None)))

    one, two = folders
    assert sorted(file.name for file in one.iterdir()) == ["SPH-FAR.csv", "SPH-FAR.json", "SPH-FAR.svg"]
    assert [file.read_bytes() for file in sorted(one.iterdir())] == [
        file.read_bytes() for file in sorted(two.iterdir())
    ]
    with (one / "SPH-FAR.csv").open(newline="") as file:
        assert [float(row["value"]) for row in csv.DictReader(file)] == list(ladder.values)
    assert json.loads((one / "SPH-FAR.json").read_text())["climbs"][0]["formula"] == "sphere/haines"
