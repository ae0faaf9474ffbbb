"""junit.xml: one test suite per family, one test case per case.

Source: the JUnit XML format as Jenkins and GitLab read it (testsuites / testsuite / testcase, with failure, error and
skipped). The file is valid by Jenkins' junit-10.xsd, and each suite by Maven Surefire's schema. Characters that XML 1.0
cannot carry (section 2.2) are left out.
"""

import re
from pathlib import Path
from xml.etree import ElementTree

from rayproof.reports.publish import PUBLISHERS
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.headline import blame, cause_of, headline, shouts
from rayproof.reports.results.json_numbers import legible, legible_lines
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.ratios import worst_ratio
from rayproof.reports.results.records import CaseRecord, RunRecord

_ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ELEMENTS = {
    Outcome.FAIL: "failure",
    Outcome.REFERENCE_SUSPECT: "failure",
    Outcome.ERROR: "error",
    Outcome.MISSING: "error",
    Outcome.UNDECIDED: "skipped",
    Outcome.UNSUPPORTED: "skipped",
}


def legal(text: object) -> str:
    """Return `text` without the characters that XML 1.0 cannot carry, or that turn or colour what a reader sees."""
    return _ILLEGAL.sub("", legible_lines(text))


@PUBLISHERS.register("junit")
def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write junit.xml."""
    # Shouted where both a reader and a parser meet it first: the root's name, on the line of the declaration.
    name = " ".join([*shouts(results), "rayproof"])
    root = ElementTree.Element("testsuites", name=legal(name))
    families: dict[str, list[CaseRecord]] = {}
    for case in results["cases"]:
        families.setdefault(case["family"], []).append(case)
    expected = frozenset(results.get("gate", {}).get("cases", ()))
    for family, cases in families.items():
        counts = _counts(cases, expected)
        suite = ElementTree.SubElement(root, "testsuite", attrib={"name": legal(legible(family)), **counts})
        for case in cases:
            _testcase(suite, case, expected, cause_of(results, case))
    root.attrib |= _counts(results["cases"], expected) | {"time": f"{float(results.get('seconds') or 0):.3f}"}
    del root.attrib["skipped"]  # which Jenkins' schema knows of suites alone
    properties = ElementTree.Element("properties")
    for key, value in {"verdict": headline(results), **results.get("environment", {})}.items():
        ElementTree.SubElement(properties, "property", name=legal(key), value=legal(value))
    if len(root):
        root[0].insert(0, properties)
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return [write_text(folder / "junit.xml", f'<?xml version="1.0" encoding="UTF-8"?>{body}\n')]


def _kind(case: CaseRecord, expected: frozenset[str]) -> str | None:
    """Return a case's element; one that a gate let through is told as skipped, as expected failures are."""
    return "skipped" if case["name"] in expected else _ELEMENTS.get(Outcome(case["verdict"]))


def _counts(cases: list[CaseRecord], expected: frozenset[str]) -> dict[str, str]:
    kinds = [_kind(case, expected) for case in cases]
    return {
        "tests": str(len(cases)),
        "failures": str(kinds.count("failure")),
        "errors": str(kinds.count("error")),
        "skipped": str(kinds.count("skipped")),
        "time": f"{sum(float(case.get('seconds') or 0) for case in cases):.3f}",
    }


def _testcase(suite: ElementTree.Element, case: CaseRecord, expected: frozenset[str], cause: str) -> None:
    test = ElementTree.SubElement(
        suite,
        "testcase",
        classname=legal(legible(case["family"])),
        name=legal(legible(case["name"])),
        time=f"{float(case.get('seconds') or 0):.3f}",
    )
    kind = _kind(case, expected)
    if kind:
        known = "expected" if case["name"] in expected else None
        message = ": ".join(filter(None, [known, case["verdict"], cause or blame(case), str(case.get("reason") or "")]))
        element = ElementTree.SubElement(test, kind, message=legal(legible(message)))
        if kind != "skipped":  # of which Surefire's schema knows no type; the message begins with the verdict
            element.set("type", case["verdict"])
        element.text = legal("\n".join(_details(case)))
    lines = [str(case.get("stresses") or ""), f"covers {', '.join(map(str, case.get('covers', [])))}"]
    # Jenkins' and GitLab's convention for attachments.
    attached = (case.get(key) for key in ("thumbnail", "picture", "scene"))
    lines += [f"[[ATTACHMENT|{path}]]" for path in attached if path]
    ElementTree.SubElement(test, "system-out").text = legal("\n".join(filter(None, lines)))


def _details(case: CaseRecord) -> list[str]:
    ratio = worst_ratio(case)
    lines = [f"worst error / limit: {ratio:.3g}"] if ratio is not None else []
    for check in case.get("checks", []):
        if check.get("verdict") not in (Outcome.PASS, Outcome.WARN):
            where = " ".join(str(check.get(key)) for key in ("configuration", "reference", "stage"))
            lines.append(f"{where}: {check.get('verdict')}: {check.get('reason') or ''}")
    return [*lines[:40], f"reproduce: {case.get('reproduce') or 'rayproof run ' + case['name']}"]
