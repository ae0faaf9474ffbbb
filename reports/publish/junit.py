"""junit.xml for test tools, with one test per case.

Source: the JUnit XML format of Jenkins and GitLab (testsuites / testsuite / testcase, with failure, error and skipped).
The file is valid in Jenkins' junit-10.xsd, each suite also in Maven Surefire's schema. Characters that XML 1.0 forbids
(section 2.2) are removed.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TextIO
from xml.etree import ElementTree

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import briefs, by_family, named
from rayproof.reports.results.files import legible, legible_lines, replacing
from rayproof.reports.results.headline import answered_in_words, blame_in_words, cause_of, headline, shouts
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import SHUTTING, GateRecord, RunRecord
from rayproof.reports.results.wrong_pixels import plain_reason, stated_reason, wrong_pixels

_ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
MOST_OF_A_GATE = 10  # lines of a kind
MOST_LISTED = 10_000  # cases; a longer run lists only the cases that did not pass
_ELEMENTS = {
    Outcome.FAIL: "failure",
    Outcome.REFERENCE_SUSPECT: "failure",
    Outcome.ERROR: "error",
    Outcome.MISSING: "error",
    Outcome.UNDECIDED: "skipped",
    Outcome.UNSUPPORTED: "skipped",
}


def legal(text: object) -> str:
    """Return `text` without characters that are forbidden in XML 1.0, or reverse or colour the displayed text."""
    return _ILLEGAL.sub("", legible_lines(text))


def publish_junit(folder: Path, results: RunRecord) -> list[Path]:
    """Write junit.xml."""
    # The loudest warnings are in the root's name, on the line of the XML declaration, which comes first in the file.
    cases, expected = results["cases"], frozenset(results.get("gate", {}).get("cases", ()))
    few = len(cases) <= MOST_LISTED
    gate = results.get("gate")
    counts = _counts(briefs(cases), expected, gate) | {"time": f"{float(results.get('seconds') or 0):.3f}"}
    del counts["skipped"]  # in Jenkins' schema only suites have this attribute
    root = ElementTree.Element("testsuites", {"name": legal(" ".join([*shouts(results), "rayproof"])), **counts})
    about = {"verdict": headline(results), **results.get("environment", {})}
    if words := answered_in_words(results):
        about["answered"] = words[0]
    if not few:
        summary = results["summary"]
        about["left out"] = left_out(summary[Outcome.PASS.value] + summary[Outcome.WARN.value])
    properties: ElementTree.Element | None = ElementTree.Element("properties")
    for key, value in about.items():
        ElementTree.SubElement(properties, "property", name=legal(key), value=legal(value))
    path = folder / "junit.xml"
    with (
        replacing(path) as draft,
        draft.open("w", encoding="utf-8", errors="replace", newline="\n") as file,
    ):
        opening = ElementTree.tostring(root, encoding="unicode").removesuffix(" />")
        file.write(f'<?xml version="1.0" encoding="UTF-8"?>{opening}>\n')
        if (
            gate is not None and properties is not None
        ):  # a separate first test, since some reasons for a red gate belong to no case
            _open(file, ElementTree.Element("testsuite", {"name": "gate", **_counts((), expected, gate)}))
            _write(file, properties, level=2)
            properties = None
            _write(file, _gate_test(gate), level=2)
            file.write("  </testsuite>\n")
        for family, members in by_family(cases):
            suite = ElementTree.Element(
                "testsuite", {"name": legal(legible(family)), **_counts(briefs(members), expected)}
            )
            _open(file, suite)
            if properties is not None:
                _write(file, properties, level=2)
                properties = None
            for brief in briefs(members):
                if few or brief["verdict"] not in (Outcome.PASS, Outcome.WARN):
                    _write(file, _testcase(cases, brief, expected, cause_of(results, brief)), level=2)
            file.write("  </testsuite>\n")
        file.write("</testsuites>\n")
    return [path]


def _gate_test(gate: GateRecord) -> ElementTree.Element:
    test = ElementTree.Element("testcase", classname="gate", name="gate", time="0.000")
    if gate["red"]:
        lines = [legible(f"{key}: {line}") for key in SHUTTING for line in gate.get(key, ())[:MOST_OF_A_GATE]]
        message = legal(legible(gate["sentence"]))
        element = ElementTree.SubElement(test, "failure", message=message, type="gate")
        element.text = legal("\n".join(lines))
    ElementTree.SubElement(test, "system-out").text = legal(legible(gate["sentence"]))
    return test


def left_out(passed: int) -> str:
    """Return a sentence on the cases that are not listed for a long run."""
    return (
        f"{passed} cases that passed or warned are counted and not listed, since the run has more than {MOST_LISTED}."
    )


def _open(file: TextIO, element: ElementTree.Element) -> None:
    """Write the start tag of an element whose children are written one by one."""
    file.write(f"  {ElementTree.tostring(element, encoding='unicode').removesuffix(' />')}>\n")


def _write(file: TextIO, element: ElementTree.Element, *, level: int) -> None:
    ElementTree.indent(element, level=level)
    file.write(f"{'  ' * level}{ElementTree.tostring(element, encoding='unicode').rstrip()}\n")


def _kind(case: CaseRecord, expected: frozenset[str]) -> str | None:
    """Return the name of a case's element; a failure accepted by a gate is skipped, like an expected failure."""
    return "skipped" if case["name"] in expected else _ELEMENTS.get(Outcome(case["verdict"]))


def _counts(cases: Iterable[CaseRecord], expected: frozenset[str], gate: GateRecord | None = None) -> dict[str, str]:
    kinds: Counter[str | None] = Counter() if gate is None else Counter(["failure" if gate["red"] else None])
    seconds = 0.0
    for case in cases:
        kinds[_kind(case, expected)] += 1
        seconds += float(case.get("seconds") or 0)
    return {
        "tests": str(kinds.total()),
        "failures": str(kinds["failure"]),
        "errors": str(kinds["error"]),
        "skipped": str(kinds["skipped"]),
        "time": f"{seconds:.3f}",
    }


def _testcase(
    cases: Sequence[CaseRecord], brief: CaseRecord, expected: frozenset[str], cause: str
) -> ElementTree.Element:
    kind = _kind(brief, expected)
    case = brief if kind is None else named(cases, brief["name"]) or brief
    test = ElementTree.Element(
        "testcase",
        classname=legal(legible(case["family"])),
        name=legal(legible(case["name"])),
        time=f"{float(case.get('seconds') or 0):.3f}",
    )
    if kind:
        kind_of_case = "expected" if case["name"] in expected else None
        message = ": ".join(
            filter(None, [kind_of_case, case["verdict"], cause or blame_in_words(case), stated_reason(case)])
        )
        element = ElementTree.SubElement(test, kind, message=legal(legible(message)))
        if kind != "skipped":  # skipped has no type in Surefire's schema; its message begins with the verdict
            element.set("type", case["verdict"])
        element.text = legal("\n".join(_details(case)))
    lines = [str(case.get("stresses") or ""), f"covers {', '.join(map(str, case.get('covers', [])))}"]
    # Jenkins' and GitLab's convention for attachments.
    attached = (case.get(key) for key in ("thumbnail", "picture", "scene"))
    lines += [f"[[ATTACHMENT|{path}]]" for path in attached if path]
    ElementTree.SubElement(test, "system-out").text = legal("\n".join(filter(None, lines)))
    return test


def _details(case: CaseRecord) -> list[str]:
    lines = list(filter(None, [wrong_pixels(case)]))
    for check in case.get("checks", []):
        if check.outcome not in (Outcome.PASS, Outcome.WARN):
            lines.append(f"{check.name}: {check.outcome}: {plain_reason(check.reason)}")
    return [*lines[:40], f"reproduce: {case.get('reproduce') or 'rayproof run ' + case['name']}"]
