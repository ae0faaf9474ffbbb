"""annotations.txt, badge.svg and summary.md for CI services.

* annotations.txt contains workflow commands of GitHub, one per cause and at most ten, because GitHub shows ten errors
  per step. Source: GitHub Actions, "Workflow commands", with its escapes of %, line ends and, in properties, of colon
  and comma.
* badge.svg shows the verdict in a flat design, without embedded fonts or requests.
* summary.md contains warnings, verdict, totals, failures with small pictures, and coverage. GitHub refuses a step
  summary of more than 1024 kB, so rows beyond that size are only counted.
"""

import html
import math
import re
from pathlib import Path
from urllib.parse import quote

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.document import whole
from rayproof.reports.results.files import legible, number, several, write_text
from rayproof.reports.results.headline import (
    BAD,
    blame_in_words,
    causes,
    examined_line,
    failure_groups,
    few_answers,
    headline,
    left_out_in_words,
    mended_in,
    remarks,
    says_little,
    share_answered,
    shouts,
    standing,
    with_its_name,
    worst_first,
)
from rayproof.reports.results.outcomes import LEDGER, TITLES, Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.reports.results.wrong_pixels import MOST_TIMES, display_name, stated_reason, wrong_pixels

MOST = 10  # errors that GitHub shows per step
_LONGEST = 1000  # characters of one message
_ESCAPES = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_IN_PROPERTIES = {":": "%3A", ",": "%2C"}


def message(text: object) -> str:
    """Return `text` as the message of a workflow command: one line that cannot begin a second command."""
    line = legible(text)[:_LONGEST]
    return "".join(_ESCAPES.get(character, character) for character in line)


def prop(text: object) -> str:
    """Return `text` as the value of a workflow command's property."""
    return "".join(_IN_PROPERTIES.get(character, character) for character in message(text))


def publish_annotations(folder: Path, results: RunRecord) -> list[Path]:
    """Write annotations.txt: the largest causes of failures, or a single notice for a run that passed."""
    lines = [f"::error title=rayproof::{message(line)}" for line in shouts(results)]
    lines += [f"::warning title=rayproof::{message(line)}" for line in left_out_in_words(results)]
    groups, gate = failure_groups(results), results.get("gate")
    new = [group for group in groups if not group.accepted]
    for group in new[:MOST]:
        case = group.worst
        why = with_its_name(results, stated_reason(case))
        size = wrong_pixels(case)
        verdict = f"{'new: ' * (gate is not None)}{case['verdict']}{f' ({size})' if size else ''}"
        sentence = ": ".join(filter(None, [verdict, group.what.removesuffix("."), why]))
        more = f" and {several(group.count - 1, 'more case')}" if group.count > 1 else ""
        lines.append(f"::error title={prop('rayproof ' + case['name'] + more)}::{message(sentence)}")
    if accepted := [group for group in groups if group.accepted]:
        largest = accepted[0].what.removesuffix(".") or accepted[0].verdict
        more = f", and {several(len(accepted) - 1, 'more cause')}" if len(accepted) > 1 else ""
        count = several(sum(group.count for group in accepted), "case")
        lines.append(f"::notice title=rayproof::{message(f'accepted: {count}: {largest}{more}')}")
    if mended := mended_in(gate):
        lines.append(f"::notice title=rayproof::{message(f'mended: {len(mended)}: {mended[0]}')}")
    left = f" The largest {MOST} of {len(new)} causes are annotated." if len(new) > MOST else ""
    level = "error" if (gate["red"] if gate else new) else "notice"
    lines.append(f"::{level} title=rayproof::{message(headline(results) + left)}")
    return [write_text(folder / "annotations.txt", "\n".join(lines) + "\n")]


LABEL = "rayproof"
CHARACTER = 7.0  # px, average width of a character of 11 px Verdana
YELLOW = "#dfb317"
# The badge also contains the verdict as text, since the colours may be hard to distinguish.
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
        accepted = len(results["gate"]["cases"])
        text_right += f", {accepted} known to fail" if accepted else ""
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


MOST_BYTES = 900_000  # of summary.md: GitHub refuses a step's summary of more than 1 MiB
MOST_OF_A_GATE = 10  # lines per section
_LONGEST_TEXT = 240  # characters of a text; a hostile name must not displace the other content
LONGEST_CAUSE = 1200  # characters of a cause together with alternative explanations
_MARKUP = re.compile(r"([\\`*_{}\[\]()#+!|~@:])")


def escaped(text: object, *, longest: int = _LONGEST_TEXT) -> str:
    """Return `text` as inert Markdown on one line, shortened to `longest` characters."""
    line = " ".join(legible(text).split())
    short = line if len(line) <= longest else line[: longest - 1] + "…"
    return _MARKUP.sub(r"\\\1", html.escape(short, quote=False))


def publish_summary(folder: Path, results: RunRecord) -> list[Path]:
    """Write summary.md."""
    head = [f"**{escaped(line)}**\n" for line in shouts(results)]
    head += [f"# rayproof: {escaped(headline(results), longest=LONGEST_CAUSE)}\n"]
    head += [f"{escaped(sentence, longest=LONGEST_CAUSE)}\n" for sentence in remarks(results)]
    head += [*_groups(results), *_gate(results), *_totals(results)]
    coverage = _coverage(results)
    failures = _failures(results, MOST_BYTES - sum(len(line.encode()) + 1 for line in head + coverage))
    # If the fixed parts are too large (a results.json with a million ids), the summary is cut at the end of a line.
    lines, size = [], 0
    for line in [*head, *failures, *coverage]:
        size += len(line.encode()) + 1
        if size > MOST_BYTES:
            lines.append("\n(cut here: the summary would exceed what CI services accept)")
            break
        lines.append(line)
    return [write_text(folder / "summary.md", "\n".join(lines) + "\n")]


def _groups(results: RunRecord) -> list[str]:
    """Return the sections of new and accepted failures and of mended cases, with counts, the largest group first."""
    groups, mended = failure_groups(results), mended_in(results.get("gate"))
    lines = []
    for title, listed in (
        ("New failures" if "gate" in results else "What is wrong", [group for group in groups if not group.accepted]),
        ("Accepted failures", [group for group in groups if group.accepted]),
    ):
        if not listed:
            continue
        lines.append(f"## {title}: {several(sum(group.count for group in listed), 'case')}\n")
        for group in listed[:MOST_OF_A_GATE]:
            cases = ", ".join(group.names[:FEW_NAMES])
            more = f" and {group.count - FEW_NAMES} more" if group.count > FEW_NAMES else ""
            size = wrong_pixels(group.worst)
            first = f"; {group.worst['name']}: {size}" if size else ""
            what = group.what.removesuffix(".") or group.verdict
            sentence = f"{several(group.count, 'case')}: {what} (in {cases}{more}{first})"
            lines.append(f"* {escaped(sentence, longest=LONGEST_CAUSE)}")
        left = len(listed) - MOST_OF_A_GATE
        lines += [f"* and {left} more, in `{whole(results)}`\n" if left > 0 else ""]
    # Diagnoses that are not the title of a group, such as the sentence that no mistake explains the failures.
    shown = {group.what for group in groups}
    lines += [f"{escaped(text, longest=LONGEST_CAUSE)}\n" for text in causes(results) if text not in shown]
    if mended:
        lines.append(f"## Mended: {len(mended)}\n")
        lines += [f"* {escaped(line)}" for line in mended[:MOST_OF_A_GATE]]
        left = len(mended) - MOST_OF_A_GATE
        lines += [f"* and {left} more, in `{whole(results)}`\n" if left > 0 else ""]
    return lines


FEW_NAMES = 3  # cases listed per group


def _gate(results: RunRecord) -> list[str]:
    """Return the sections of a gate: reasons why it is red, and accepted failures with their reasons."""
    gate = results.get("gate")
    if gate is None:
        return []
    titles = {
        "regressions": "Not accepted",
        "worse": "Worse than before",
        "uncovered": "Too little was measured",
        "stale": "Entries that meet no check",
        "expired": "Expired entries",
        "matched": "Accepted, with the reasons",
    }
    lines = []
    for key, title in titles.items():
        if listed := gate.get(key, ()):
            lines += [f"## {title}: {len(listed)}\n", *(f"* {escaped(line)}" for line in listed[:MOST_OF_A_GATE])]
            left = len(listed) - MOST_OF_A_GATE
            lines += [f"* and {left} more, in `{whole(results)}`\n" if left > 0 else ""]
    return lines


def _totals(results: RunRecord) -> list[str]:
    lines = ["| | " + " | ".join(name.replace("_", " ") for name in LEDGER) + " |", "|---" * (len(LEDGER) + 1) + "|"]
    for key, what in (("summary", "cases"), ("checks", "checks")):
        lines.append(f"| {what} | " + " | ".join(str(results[key][name]) for name in LEDGER) + " |")
    examined = examined_line(results)
    lines += ["", *([f"{escaped(examined, longest=LONGEST_CAUSE)}\n"] if examined else [])]
    seconds = float(results.get("seconds") or 0)
    return [*lines, "", f"{seconds:.0f} s; `{whole(results)}` and `index.html` have the rest.\n"]


def _failures(results: RunRecord, room: int) -> list[str]:
    listed = {outcome.value for outcome in BAD | {Outcome.UNDECIDED, Outcome.UNSUPPORTED}}
    lines = ["## What did not pass\n", "| case | verdict | blamed | wrong pixels | why |", "|---|---|---|---|---|"]
    room -= sum(len(line.encode()) + 1 for line in lines) + 200
    count = left = 0
    drawn: list[CaseRecord] = []
    for case in briefs(worst_first(results["cases"])):
        if case["verdict"] not in listed:
            continue
        count += 1
        drawn += [case] if case.get("thumbnail") else []
        if room < 0:
            left += 1
            continue
        cells = (
            case["name"],
            case["verdict"],
            blame_in_words(case),
            wrong_pixels(case),
            stated_reason(case),
        )
        row = "| " + " | ".join(map(escaped, cells)) + " |"
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
    lines = ["## Coverage by specification id\n", "| item | cases | failed | worst error / limit | references |"]
    lines.append("|---|---|---|---|---|")
    for item, cases in results["coverage"].items():
        detail = results.get("coverage_detail", {}).get(item, {})
        ratio = number(detail.get("worst_ratio"))
        worst = "" if ratio is None else f"{ratio:.3g}" if ratio < MOST_TIMES else f"over {MOST_TIMES:g}"
        cells = (f"{item} {TITLES.get(item, '')}".rstrip(), cases, detail.get("failed", ""), worst)
        references = ", ".join(map(display_name, map(str, detail.get("references", []))))
        lines.append("| " + " | ".join(escaped(cell) for cell in (*cells, references)) + " |")
    return lines
