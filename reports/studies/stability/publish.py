"""Ladders as files: JSON, CSV and a still SVG each, the same bytes whenever the numbers are the same."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path

from rayproof.cases.ladders import Ladder
from rayproof.reports.results.json_numbers import plain
from rayproof.reports.studies.stability.document import about
from rayproof.reports.studies.stability.records import ClimbRecord, LadderRecord

FIRST_COLUMNS = ("formula", "precision")


def publish(folder: Path, ladder: Ladder, records: Sequence[ClimbRecord]) -> None:
    """Write NAME.json, NAME.csv and NAME.svg of one ladder to `folder`, which is there."""
    from rayproof.reports.studies.stability.figures import figure

    whole: LadderRecord = {**about(ladder), "climbs": list(records)}
    content = json.dumps(plain(whole), indent=2, allow_nan=False)
    (folder / f"{ladder.name}.json").write_text(content + "\n", encoding="utf-8")
    rows = [
        {"formula": one["formula"], "precision": one["precision"]} | rung for one in records for rung in one["values"]
    ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with (folder / f"{ladder.name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    figure(folder / f"{ladder.name}.svg", ladder, records)
