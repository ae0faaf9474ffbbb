"""summary.md has totals, failures and coverage, cannot be hijacked by a name, and never reaches 1 MB."""

import copy

from rayproof.reports.publish.summaries import escaped
from rayproof.reports.publish.summaries import publish_summary as publish
from tests.reports.publish.sample import HOSTILE, results_of


def test_totals_failures_and_coverage_are_there(published):
    text = (published.folder / "summary.md").read_text()

    assert "| cases | 9 | 1 | 1 | 0 | 1 | 1 | 1 | 1 | 3 |" in text
    assert "| sphere/sheared | fail | normal NRM-3 |" in text
    assert "| CAM-4 | 9 | 0 |" in text
    assert "mesh/huge" in text
    assert "sphere/plain" not in text


def test_a_hostile_name_stays_text_in_its_own_cell(published):
    text = (published.folder / "summary.md").read_text()
    row = next(line for line in text.splitlines() if "evil/" in line)

    assert "<script" not in text
    assert "<img" not in text
    assert row.replace("\\|", "").count("|") == 6
    assert "\\`" in escaped(HOSTILE)
    assert "\n" not in escaped("a\nb\r\nc")


def test_ten_thousand_failures_with_long_reasons_stay_below_the_limit(tmp_path, published):
    failed = published.results["cases"][1]
    cases = []
    for index in range(10_000):
        case = copy.copy(failed)
        case |= {"name": f"many/case_{index}", "checks": [], "reason": "<&|" * 5000}
        cases.append(case)

    (path,) = publish(tmp_path, results_of(cases))

    assert path.stat().st_size < 1_000_000
    assert "more are left out here" in path.read_text()
    assert "| RAD-5 |" in path.read_text()
