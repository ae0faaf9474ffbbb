"""The classes of records: what they name is documented, and what is documented is named."""

import re
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.history import expectations
from rayproof.reports.judge import checks, measurement
from rayproof.reports.publish.page import front
from rayproof.reports.results import case_records, records

PAGE = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")


def documented(heading: str) -> set[str]:
    """Return the names in the first column of the table below a heading of docs/results.md."""
    section = PAGE.split(f"{heading}\n", 1)[1].split("\n#", 1)[0]
    rows = re.findall(r"^\| (`[^|]*) \|", section, re.MULTILINE)
    return {name for row in rows for name in re.findall(r"`(\w+)`", row)}


def test_one_check_is_described_by_few_types() -> None:
    """Beside a check and its measurement: how it differs between two runs, its entry in a gate, its group in a file."""
    classes = {
        one.__name__
        for module in (case_records, records, expectations, checks, measurement, front)
        for name, one in vars(module).items()
        if isinstance(one, type) and re.search("Check|Measure", name) and one.__module__ == module.__name__
    }

    assert classes == {"Check", "Measurement", "ComparedCheckRecord", "KnownCheck", "CheckGroupRecord"}
    for part in (case_records.Examined, case_records.Bias, case_records.FactorGroup, case_records.Leaning):
        assert not hasattr(case_records, f"{part.__name__}Record"), "what is judged is what is written"


@pytest.mark.parametrize(
    ("heading", "record"),
    [
        ("## results.json", records.RunRecord),
        ("### Diagnosis", records.CauseRecord),
        ("### A case", case_records.CaseRecord),
        ("### A case's `adjudication`", case_records.AdjudicationRecord),
        ("### A check", case_records.Check),
        ("### Pixel counts", case_records.Examined),
        ("### A check's `bias`", case_records.Bias),
        ("### A measurement", case_records.Measurement),
    ],
)
def test_the_page_on_results_names_the_keys_of_the_classes(heading: str, record: Any) -> None:
    # `pixels` of what was examined is explained above its table, as the sum of the rest; `strict` is what others leave.
    above = {"pixels"} if record is case_records.Examined else set()

    known = getattr(record, "__struct_encode_fields__", record.__annotations__)
    judging = case_records.JUDGING.get(record.__name__, ())
    assert documented(heading) - {"strict"} | above == {*known} - {*judging}


def test_pixel_counts_have_a_number_for_each_kind_and_add_up() -> None:
    counts = case_records.Examined(wide=1, rounding=2, epsilon=3, wrong=4, unexamined=5, pixels=21)

    assert counts.strict == 6
    assert [kind.name.lower() for kind in measurement.Kind] == list(counts.counts)[1:]
    assert sum(counts.counts.values()) == 2 * counts.pixels
    assert (counts + counts).counts == {name: 2 * count for name, count in counts.counts.items()}


def test_the_schema_names_explained_and_wrong_pixels() -> None:
    definitions = records.schema()["$defs"]

    assert {"rounding", "epsilon", "wrong"} <= set(definitions["Examined"]["properties"])
    assert {"explained", "wrong", "interior"} <= set(definitions["Measurement"]["properties"])
