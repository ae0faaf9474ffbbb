"""For CI services: annotations.txt, badge.svg and summary.md.

* annotations.txt holds GitHub's workflow commands, one for each of ten causes: GitHub shows ten errors a step. Source:
  GitHub Actions, "Workflow commands", with its escapes of %, line ends and, in properties, of colon and comma.
* badge.svg shows the verdict, flat, without fonts or requests of its own.
* summary.md has warnings, verdict, totals, failures with small pictures, and coverage. GitHub refuses a step summary of
  more than 1024 kB, so rows are left out, and counted, before that.
"""

import html
import math
import re
from collections import Counter
from pathlib import Path
from urllib.parse import quote

from rayproof.reports.results.case_records import CaseRecord, worst_ratio
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.document import whole
from rayproof.reports.results.files import legible, number, write_text
from rayproof.reports.results.headline import (
    BAD,
    blame,
    cause_of,
    causes,
    examined_line,
    few_answers,
    headline,
    left_out_in_words,
    no_say,
    of_the_whole,
    says_little,
    share_answered,
    shouts,
    standing,
    with_its_name,
    worst_first,
)
from rayproof.reports.results.outcomes import LEDGER, Outcome
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


def publish_annotations(folder: Path, results: RunRecord) -> list[Path]:
    """Write annotations.txt; of a run that passed, one notice."""
    lines = [f"::error title=rayproof::{message(line)}" for line in shouts(results)]
    gate = results.get("gate")
    expected = set(gate["cases"] if gate else ())  # what a gate let through annotates nothing
    lines += [f"::warning title=rayproof::{message(line)}" for line in left_out_in_words(results)]
    causes: dict[str, list[CaseRecord]] = {}  # what is wrong -> the worst of its cases
    counts: Counter[str] = Counter()
    for case in briefs(worst_first(results["cases"])):
        if Outcome(case["verdict"]) not in BAD:
            break  # the rest is better
        if case["name"] not in expected:
            what = cause_of(results, case) or f"{case['verdict']} {blame(case)}"
            causes.setdefault(what, []).extend([case][: not counts[what]])
            counts[what] += 1
    for what, (case, *_) in list(causes.items())[:MOST]:
        ratio = worst_ratio(case)
        size = "" if ratio is None else f" (error / limit {ratio:.3g})"
        why = with_its_name(results, case.get("reason") or "")
        because = cause_of(results, case).removesuffix(".") or blame(case)
        said = ": ".join(filter(None, [f"{case['verdict']}{size}", because, why]))
        more = f" and {counts[what] - 1} more cases" if counts[what] > 1 else ""
        lines.append(f"::error title={prop('rayproof ' + case['name'] + more)}::{message(said)}")
    left = f" The worst {MOST} of {len(causes)} causes are annotated." if len(causes) > MOST else ""
    level = "error" if (gate["red"] if gate else counts) else "notice"
    lines.append(f"::{level} title=rayproof::{message(headline(results) + left)}")
    return [write_text(folder / "annotations.txt", "\n".join(lines) + "\n")]


LABEL = "rayproof"
CHARACTER = 7.0  # px that a character of 11 px Verdana takes on average
YELLOW = "#dfb317"
# Told apart without colour too: by their words.
COLORS = {
    Outcome.PASS: "#2a7f3f",
    Outcome.WARN: YELLOW,
    Outcome.UNDECIDED: "#5a5a5a",
    Outcome.UNSUPPORTED: "#5a5a5a",
    Outcome.MISSING: "#a34700",
    Outcome.REFERENCE_SUSPECT: "#a34700",
    Outcome.ERROR: "#a34700",
    Outcome.FAIL: "#b3261e",
}

_BADGE = """<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="20" role="img" aria-label="{title}">
<title>{title}</title>
<rect width="{left:g}" height="20" fill="#444"/><rect x="{left:g}" width="{right:g}" height="20" fill="{color}"/>
<g fill="#fff" text-anchor="middle" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11">
<text x="{label_x:g}" y="14">{label}</text><text x="{said_x:g}" y="14" fill="{ink}">{said}</text>
</g>
</svg>
"""


def publish_badge(folder: Path, results: RunRecord) -> list[Path]:
    """Write badge.svg."""
    summary = results["summary"]
    verdict = Outcome(results.get("verdict", Outcome.MISSING))
    good = summary[Outcome.PASS.value] + summary[Outcome.WARN.value]
    text_right, color = f"{good} of {summary['planned']} pass", COLORS[verdict]
    if "gate" in results:
        verdict = Outcome.FAIL if results["gate"]["red"] else Outcome.PASS
        color, text_right = COLORS[verdict], f"{standing(results)}: {text_right}"
        known = len(results["gate"]["cases"])
        text_right += f", {known} known to fail" if known else ""
    elif verdict not in (Outcome.PASS, Outcome.WARN):
        text_right = f"{verdict.value.replace('_', ' ')}: {text_right}"
    if (share := share_answered(results)) < 1:
        text_right += f", {math.floor(100 * share)} % answered"
    if few_answers(results):
        text_right = f"few answers: {text_right}"
    if verdict is Outcome.PASS and says_little(results):
        color = YELLOW
    if shouts(results):
        text_right, color = "not a verdict", COLORS[Outcome.ERROR]
    left, right = (CHARACTER * len(text) + 10 for text in (LABEL, text_right))
    svg = _BADGE.format(
        width=left + right,
        left=left,
        right=right,
        color=color,
        ink="#222" if color == YELLOW else "#fff",
        label=LABEL,
        said=html.escape(text_right),
        label_x=left / 2,
        said_x=left + right / 2,
        title=html.escape(f"{LABEL}: {text_right}"),
    )
    return [write_text(folder / "badge.svg", svg)]


MOST_BYTES = 900_000
MOST_OF_A_GATE = 10  # lines of a kind
_LONGEST_TEXT = 240  # characters of any one text; a hostile name must not push the rest out
LONGEST_CAUSE = 1200  # characters of a cause with all that fits as well
_MARKUP = re.compile(r"([\\`*_{}\[\]()#+!|~@:])")


def escaped(text: object, *, longest: int = _LONGEST_TEXT) -> str:
    """Return `text` as inert Markdown on one line, shortened."""
    line = " ".join(legible(text).split())
    short = line if len(line) <= longest else line[: longest - 1] + "…"
    return _MARKUP.sub(r"\\\1", html.escape(short, quote=False))


def publish_summary(folder: Path, results: RunRecord) -> list[Path]:
    """Write summary.md."""
    head = [f"**{escaped(line)}**\n" for line in shouts(results)]
    head += [f"# rayproof: {escaped(headline(results), longest=LONGEST_CAUSE)}\n", *_totals(results)]
    head += _gate(results)
    if sentences := [*of_the_whole(results), *causes(results)]:
        head += ["## What is wrong\n", *(f"* {escaped(sentence, longest=LONGEST_CAUSE)}" for sentence in sentences), ""]
    coverage = _coverage(results)
    failures = _failures(results, MOST_BYTES - sum(len(line.encode()) + 1 for line in head + coverage))
    # Were the fixed parts alone too large (a results.json with a million ids), the end is cut at a line.
    lines, size = [], 0
    for line in [*head, *failures, *coverage]:
        size += len(line.encode()) + 1
        if size > MOST_BYTES:
            lines.append("\n(cut here: the summary would exceed what CI services accept)")
            break
        lines.append(line)
    return [write_text(folder / "summary.md", "\n".join(lines) + "\n")]


def _gate(results: RunRecord) -> list[str]:
    """Return what a gate let through and what it did not, the most telling first."""
    told = results.get("gate")
    if told is None:
        return []
    titles = {
        "regressions": "Not expected",
        "worse": "Worse than before",
        "uncovered": "Too little was measured",
        "tighten": "Fails less than expected",
        "stale": "Entries that meet no check",
        "expired": "Expired entries",
        "matched": "Expected, and let through",
    }
    lines = []
    for key, title in titles.items():
        if listed := told.get(key, ()):
            lines += [f"## {title}: {len(listed)}\n", *(f"* {escaped(line)}" for line in listed[:MOST_OF_A_GATE])]
            left = len(listed) - MOST_OF_A_GATE
            lines += [f"* and {left} more, in `{whole(results)}`\n" if left > 0 else ""]
    return lines


def _totals(results: RunRecord) -> list[str]:
    lines = ["| | " + " | ".join(name.replace("_", " ") for name in LEDGER) + " |", "|---" * (len(LEDGER) + 1) + "|"]
    for key, what in (("summary", "cases"), ("checks", "checks")):
        lines.append(f"| {what} | " + " | ".join(str(results[key][name]) for name in LEDGER) + " |")
    told = filter(None, [examined_line(results), *no_say(results)])
    lines += ["", *(f"{escaped(sentence, longest=LONGEST_CAUSE)}\n" for sentence in told)]
    seconds = float(results.get("seconds") or 0)
    return [*lines, "", f"{seconds:.0f} s; `{whole(results)}` and `index.html` have the rest.\n"]


def _failures(results: RunRecord, room: int) -> list[str]:
    told = {outcome.value for outcome in BAD | {Outcome.UNDECIDED, Outcome.UNSUPPORTED}}
    lines = ["## What did not pass\n", "| case | verdict | blamed | error / limit | why |", "|---|---|---|---|---|"]
    room -= sum(len(line.encode()) + 1 for line in lines) + 200
    count = left = 0
    drawn: list[CaseRecord] = []
    for case in briefs(worst_first(results["cases"])):
        if case["verdict"] not in told:
            continue
        count += 1
        drawn += [case] if case.get("thumbnail") else []
        if room < 0:
            left += 1
            continue
        ratio = worst_ratio(case)
        cells = (case["name"], case["verdict"], blame(case), "" if ratio is None else f"{ratio:.3g}")
        row = "| " + " | ".join(escaped(cell) for cell in (*cells, case.get("reason") or "")) + " |"
        room -= len(row.encode()) + 1
        if room < 0:
            left += 1
        else:
            lines.append(row)
    if not count:
        return []
    if left:
        lines.append(f"\n{left} more are left out here; `{whole(results)}` has them all.")
    if drawn:
        lines += ["", "Ours, the reference's, and their difference, worst first:\n"]
        lines += [
            f"![{i}]({quote(str(case['thumbnail']))}) {escaped(case['name'])}\n"
            for i, case in enumerate(drawn, start=1)
        ]
    return [*lines, ""]


def _coverage(results: RunRecord) -> list[str]:
    lines = ["## Coverage by specification id\n", "| id | cases | failed | worst error / limit | references |"]
    lines.append("|---|---|---|---|---|")
    for item, cases in results["coverage"].items():
        detail = results.get("coverage_detail", {}).get(item, {})
        ratio = number(detail.get("worst_ratio"))
        cells = (item, cases, detail.get("failed", ""), "" if ratio is None else f"{ratio:.3g}")
        references = ", ".join(map(str, detail.get("references", [])))
        lines.append("| " + " | ".join(escaped(cell) for cell in (*cells, references)) + " |")
    return lines
