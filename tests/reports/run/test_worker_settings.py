"""Which workers a run lets sleep side by side."""

from rayproof.reports.run.workers import sleeping


def test_povray_sleeps_as_a_reference_and_under_test_and_no_one_who_computes_does() -> None:
    assert sleeping() == {"reference:povray", "subject:povray"}
