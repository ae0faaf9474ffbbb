"""junit.xml parses, counts, and maps verdicts onto failures, errors and skips."""

from xml.etree import ElementTree

from rayproof.reports.results.files import legible
from tests.reports.publish.sample import HOSTILE


def test_verdicts_become_failures_errors_and_skips(published):
    root = ElementTree.parse(published.folder / "junit.xml").getroot()
    kinds = {
        case.get("name"): [child.tag for child in case if child.tag != "system-out"] for case in root.iter("testcase")
    }

    assert kinds["sphere/plain"] == []
    assert kinds["plane/tilted"] == []
    assert kinds["sphere/sheared"] == ["failure"]
    assert kinds[legible(HOSTILE)] == ["failure"]
    assert kinds["mesh/crash"] == ["error"]
    assert kinds["mesh/empty"] == ["error"]
    assert kinds["mesh/huge"] == ["skipped"]


def test_one_suite_per_family_and_counts_that_add_up(published):
    root = ElementTree.parse(published.folder / "junit.xml").getroot()
    suites = root.findall("testsuite")

    assert [suite.get("name") for suite in suites] == ["sphere", "lights", "evil", "mesh", "plane"]
    for key in ("tests", "failures", "errors"):
        assert int(root.get(key) or -1) == sum(int(suite.get(key) or -1) for suite in suites)
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("9", "4", "2")
    assert sum(int(suite.get("skipped") or -1) for suite in suites) == 1


def test_characters_that_xml_cannot_carry_are_replaced(published):
    crash = next(
        case
        for case in ElementTree.parse(published.folder / "junit.xml").iter("testcase")
        if case.get("name") == "mesh/crash"
    )

    error = crash.find("error")
    assert error is not None
    assert error.get("message") == "error: worker ended with signal 6" + 2 * "\N{REPLACEMENT CHARACTER}"
