"""summary.md has totals, failures and coverage, cannot be hijacked by a name, and never reaches 1 MB."""

import copy

from rayproof.reports.publish.summaries import escaped
from rayproof.reports.publish.summaries import publish_summary as publish
from tests.reports.publish.sample import HOSTILE, make_folder, results_of


def test_a_hostile_name_stays_text_in_its_own_cell(published):
    text = (published.folder / "summary.md").read_text()
    row = next(line for line in text.splitlines() if line.startswith("| evil/"))

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
    assert "| RAD-5 radiance" in path.read_text()


def test_new_accepted_and_mended_failures_are_apart_each_with_its_count(tmp_path):
    results = make_folder(tmp_path)
    gate = {
        "file": "known.json", "sentence": "", "red": True, "regressions": ["sphere/sheared: no entry is about it"],
        "tighten": ["plane/tilted: float32 analytic ray passes now"], "stale": [], "expired": [],
        "matched": ["lights/acne: 4 failing checks: it is known"], "cases": ["lights/acne", "lights/broken"],
    }  # fmt: skip

    (path,) = publish(tmp_path, results | {"gate": gate})

    text = path.read_text().replace("\\", "")
    titles = [line for line in text.splitlines() if line.startswith("## ")]
    assert titles[:3] == ["## New failures: 4 cases", "## Accepted failures: 2 cases", "## Mended: 1"]
    assert "12 of 4,000 pixels wrong at normal, by 0.017 on average" in text
    assert "inf" not in [cell.strip() for line in text.splitlines() for cell in line.split("|")]
