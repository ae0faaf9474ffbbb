"""annotations.txt: GitHub's workflow commands for the worst ten cases, which a CI job prints to annotate its run.

Source: GitHub Actions, "Workflow commands", with its escapes of %, line ends and, in properties, of colon and comma.
GitHub shows ten errors a step.
"""

from pathlib import Path

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.headline import BAD, blame, cause_of, headline, shouts, worst_first
from rayproof.reports.results.json_numbers import legible
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.ratios import worst_ratio
from rayproof.reports.results.records import RunRecord

MOST = 10
_LONGEST = 1000  # characters of one message
_ESCAPES = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_IN_PROPERTIES = {":": "%3A", ",": "%2C"}


def message(text: object) -> str:
    """Return `text` as a workflow command's message: one line, in which nothing begins a second command."""
    line = legible(text)[:_LONGEST]
    return "".join(_ESCAPES.get(character, character) for character in line)


def prop(text: object) -> str:
    """Return `text` as a property's value."""
    return "".join(_IN_PROPERTIES.get(character, character) for character in message(text))


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write annotations.txt; of a run that passed, one notice."""
    lines = [f"::error title=rayproof::{message(line)}" for line in shouts(results)]
    told = results.get("gate")
    expected = set(told["cases"] if told else ())  # what a gate let through annotates nothing
    bad = 0
    for case in briefs(worst_first(results["cases"])):
        if Outcome(case["verdict"]) not in BAD:
            break  # the rest is better
        if case["name"] in expected:
            continue
        bad += 1
        if bad > MOST:
            continue
        ratio = worst_ratio(case)
        size = "" if ratio is None else f" (error / limit {ratio:.3g})"
        what = cause_of(results, case) or blame(case)
        said = ": ".join(filter(None, [f"{case['verdict']}{size}", what, str(case.get("reason") or "")]))
        lines.append(f"::error title={prop('rayproof ' + case['name'])}::{message(said)}")
    left = f" The worst {MOST} of {bad} are annotated." if bad > MOST else ""
    level = "error" if bad or (told and told["red"]) else "notice"
    lines.append(f"::{level} title=rayproof::{message(headline(results) + left)}")
    return [write_text(folder / "annotations.txt", "\n".join(lines) + "\n")]
