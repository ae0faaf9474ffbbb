"""ctrf.json keeps the Common Test Report Format: its required fields, statuses and sums, and no field it forbids."""

import json

SUMMARY = {"tests", "passed", "failed", "skipped", "pending", "other", "start", "stop"}
OF_A_TEST = {"name", "status", "rawStatus", "duration", "suite", "tags", "message", "attachments", "extra"}


def test_the_required_fields_are_there(published):
    document = json.loads((published.folder / "ctrf.json").read_text())
    results = document["results"]

    assert (document["reportFormat"], document["specVersion"]) == ("CTRF", "0.0.0")
    assert set(document) <= {"reportFormat", "specVersion", "generatedBy", "extra", "results"}
    assert set(results) == {"tool", "summary", "tests", "environment"}
    assert set(results["summary"]) >= SUMMARY
    assert all(isinstance(results["summary"][key], int) for key in SUMMARY)
    assert results["summary"]["stop"] - results["summary"]["start"] == 61500
    for test in results["tests"]:
        assert set(test) <= OF_A_TEST
        assert isinstance(test["duration"], int)


def test_the_counts_are_those_of_the_tests(published):
    results = json.loads((published.folder / "ctrf.json").read_text())["results"]
    statuses = [test["status"] for test in results["tests"]]

    for status in ("passed", "failed", "skipped", "pending", "other"):
        assert results["summary"][status] == statuses.count(status)
    assert results["summary"]["tests"] == len(statuses) == 9
    assert (statuses.count("passed"), statuses.count("failed"), statuses.count("other")) == (2, 4, 2)
