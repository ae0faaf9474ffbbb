"""An audit beside the results is shown; one that cannot be read is not."""

import json
from pathlib import Path

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.audit import front, load_audit, sentence
from tests.reports.publish.sample import make_folder

AUDIT = {
    "planted": 3,
    "killed": 2,
    "equivalent": 1,
    "blamed_right": 2,
    "false_alarms": 0,
    "good": True,
    "problems": [],
    "smallest_detected": {"flux": {"float32": {"irradiance": 1e-5}}},
    "faults": [
        {
            "name": "falloff/fault_<b>",
            "where": "tracer",
            "stage": "irradiance",
            "killed": True,
            "families": {"primitives": {"cases": 1, "killed": 1, "stage": "irradiance"}},
            "references": {"analytic": {"sees": True, "killed": True, "stage": "irradiance"}},
        }
    ],
}


def test_the_score_is_on_the_front_page_and_in_the_summary(tmp_path: Path) -> None:
    make_folder(tmp_path)
    (tmp_path / "audit.json").write_text(json.dumps(AUDIT))

    publish_all(tmp_path)

    assert "2 of 2 planted faults killed" in (tmp_path / "index.html").read_text()
    assert "2 of 2 planted faults killed" in (tmp_path / "summary.md").read_text()
    assert "fault_<b>" not in (tmp_path / "index.html").read_text()


def test_the_matrix_lists_families_and_references() -> None:
    shown = front(AUDIT)

    assert shown is not None
    assert (shown["families"], shown["references"]) == (["primitives"], ["analytic"])
    assert "1 more" in sentence(AUDIT)


@pytest.mark.parametrize("content", [None, "", "[]", "{}", '{"planted": 1}', "nan"])
def test_what_is_no_audit_is_none(tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "audit.json").write_text(content)

    assert load_audit(tmp_path) is None
    assert front(None) is None
