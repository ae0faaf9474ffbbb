"""summary.md for CI step summaries: shouts, verdict, totals, what failed with small pictures, coverage; never 1 MB.

GitHub refuses a whole step summary of more than 1024 kB, so rows are left out, and counted, before that.
"""

import html
import re
from pathlib import Path
from urllib.parse import quote

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.document import whole
from rayproof.reports.results.headline import (
    BAD,
    blame,
    causes,
    examined_line,
    headline,
    no_say,
    of_the_whole,
    shouts,
    worst_first,
)
from rayproof.reports.results.json_numbers import legible, number
from rayproof.reports.results.outcomes import LEDGER, Outcome
from rayproof.reports.results.ratios import worst_ratio
from rayproof.reports.results.records import CaseRecord, RunRecord

MOST_BYTES = 900_000
MOST_OF_A_GATE = 50  # lines of a kind
_LONGEST = 240  # characters of any one text; a hostile name must not push the rest out
LONGEST_CAUSE = 1200  # characters of a cause with all that fits as well
_MARKUP = re.compile(r"([\\`*_{}\[\]()#+!|~@:])")


def escaped(text: object, *, longest: int = _LONGEST) -> str:
    """Return `text` as inert Markdown on one line, shortened."""
    line = " ".join(legible(text).split())
    short = line if len(line) <= longest else line[: longest - 1] + "…"
    return _MARKUP.sub(r"\\\1", html.escape(short, quote=False))


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write summary.md."""
    head = [f"**{escaped(line)}**\n" for line in shouts(results)]
    head += [f"# rayproof: {escaped(headline(results))}\n", *_totals(results)]
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
    line = examined_line(results)
    lines += ["", *(f"{escaped(each)}\n" for each in (*([line] if line else []), *no_say(results)))]
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
