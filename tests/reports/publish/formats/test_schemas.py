"""junit.xml is valid by the schemas of those who read it.

Jenkins' schema is the one in pytest's source distribution (`schemas/junit-10.xsd`, MIT). No package has that of Maven
Surefire: what it demands of a suite is written down here (surefire-test-report.xsd, as of Surefire 3).
"""

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.results.document import save_results
from tests.reports.publish.sample import make_folder

SCHEMAS = Path(__file__).parent / "schemas"
# Of each element: the attributes that it must have, those that it may have, and its children in their order.
SUREFIRE: dict[str, tuple[set[str], set[str], list[str]]] = {
    "testsuite": (
        {"name", "tests", "errors", "skipped", "failures"},
        {"time", "group"},
        ["properties", "testcase"],
    ),
    "properties": (set(), set(), ["property"]),
    "property": ({"name", "value"}, set(), []),
    "testcase": (
        {"name", "time"},
        {"classname", "group"},
        ["failure", "skipped", "error", "system-out", "system-err"],
    ),
    "failure": ({"type"}, {"message"}, []),
    "error": ({"type"}, {"message"}, []),
    "skipped": (set(), {"message"}, []),
    "system-out": (set(), set(), []),
    "system-err": (set(), set(), []),
}
ONCE = {"testcase": {"skipped", "error", "system-out", "system-err"}}
TIME = re.compile(r"[0-9]*(\.[0-9]{0,3})?")


def complaints(element: ElementTree.Element) -> Iterator[str]:
    """Yield what Surefire's schema has against an element and what is below it."""
    needed, allowed, order = SUREFIRE[element.tag]
    given = set(element.keys())
    if missing := needed - given:
        yield f"{element.tag} has no {sorted(missing)}"
    if unknown := given - needed - allowed:
        yield f"{element.tag} has the unknown {sorted(unknown)}"
    if "time" in given and not TIME.fullmatch(element.get("time", "")):
        yield f"{element.tag} has the time {element.get('time')}"
    tags = [child.tag for child in element]
    if strange := set(tags) - set(order):
        yield f"{element.tag} holds the unknown {sorted(strange)}"
        return
    if tags != sorted(tags, key=order.index):
        yield f"{element.tag} holds {tags} in another order than {order}"
    for tag in ONCE.get(element.tag, set()):
        if tags.count(tag) > 1:
            yield f"{element.tag} holds {tag} twice"
    for child in element:
        yield from complaints(child)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return published folders: the sample, with a gate that let a failing case through, and with a red one."""
    found = []
    for name in ("plain", "gated", "red"):
        folder = tmp_path_factory.mktemp(name)
        results = make_folder(folder)
        if name != "plain":
            failing = [case["name"] for case in results["cases"] if case["verdict"] == "fail"]
            lists = {key: [] for key in ("regressions", "tighten", "stale", "expired")}
            results["gate"] = {
                "file": "f",
                "sentence": "s",
                "red": name == "red",
                **lists,
                "matched": failing,
                "cases": failing,
            }
            save_results(folder, results)
        publish_all(folder)
        found.append(folder)
    return found


def test_junit_is_valid_for_jenkins(folders: list[Path]) -> None:
    xmlschema = pytest.importorskip("xmlschema", reason="xmlschema is not installed; ./rayproof test installs it")
    schema = xmlschema.XMLSchema10(SCHEMAS / "junit-10.xsd")

    for folder in folders:
        schema.validate(folder / "junit.xml")
    broken = ElementTree.parse(folders[0] / "junit.xml")
    broken.getroot().set("skipped", "1")  # as it was once
    assert not schema.is_valid(broken)


def test_each_suite_of_junit_is_valid_for_surefire(folders: list[Path]) -> None:
    suites = [suite for folder in folders for suite in ElementTree.parse(folder / "junit.xml").iter("testsuite")]

    assert suites
    assert [said for suite in suites for said in complaints(suite)] == []
    kinds = {child.tag for suite in suites for child in suite.iter()}
    assert kinds >= {"properties", "failure", "error", "skipped", "system-out"}


def test_the_gate_is_the_first_test_and_what_it_lets_through_is_skipped(folders: list[Path]) -> None:
    for folder, is_red in zip(folders[1:], (False, True), strict=True):
        root = ElementTree.parse(folder / "junit.xml").getroot()
        first, *others = root.iter("testcase")

        assert (first.get("name"), first.find("failure") is not None) == ("gate", is_red)
        skipped = [test.find("skipped") for test in others if test.find("skipped") is not None]
        assert any(str(element.get("message")).startswith("expected: fail") for element in skipped)
        failures = [test.find("failure") for test in others if test.find("failure") is not None]
        assert {element.get("type") for element in failures} == {"reference_suspect"}
        assert (root.get("tests"), root.get("failures")) == (str(1 + len(others)), str(is_red + len(failures)))
