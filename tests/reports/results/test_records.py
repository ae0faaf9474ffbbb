"""The classes of records: what they name is documented, and what is documented is named."""

import re
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.results import case_records, records

PAGE = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")


def documented(heading: str) -> set[str]:
    """Return the names in the first column of the table below a heading of docs/results.md."""
    section = PAGE.split(f"{heading}\n", 1)[1].split("\n#", 1)[0]
    rows = re.findall(r"^\| (`[^|]*) \|", section, re.MULTILINE)
    return {name for row in rows for name in re.findall(r"`(\w+)`", row)}


@pytest.mark.parametrize(
    ("heading", "record"),
    [
        ("## results.json", records.RunRecord),
        ("### Diagnosis", records.CauseRecord),
        ("### A case", case_records.CaseRecord),
        ("### A case's `adjudication`", case_records.AdjudicationRecord),
        ("### A check", case_records.CheckRecord),
        ("### What was examined", case_records.ExaminedRecord),
        ("### A check's `bias`", case_records.BiasRecord),
        ("### A measurement", case_records.MeasurementRecord),
    ],
)
def test_the_page_on_results_names_the_keys_of_the_classes(heading: str, record: Any) -> None:
    # `pixels` of what was examined is explained above its table, as the sum of the rest.
    above = {"pixels"} if record is case_records.ExaminedRecord else set()

    assert documented(heading) | above == set(record.__annotations__)
