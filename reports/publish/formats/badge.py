"""badge.svg: the verdict on a badge for a README, flat and without fonts or requests of its own."""

import html
from pathlib import Path

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.headline import shouts
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

LABEL = "rayproof"
CHARACTER = 7.0  # px that a character of 11 px Verdana takes on average
# Told apart without colour too: by their words.
COLORS = {
    Outcome.PASS: "#2a7f3f",
    Outcome.WARN: "#7a6a00",
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
<text x="{label_x:g}" y="14">{label}</text><text x="{said_x:g}" y="14">{said}</text>
</g>
</svg>
"""


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write badge.svg."""
    summary = results["summary"]
    verdict = Outcome(results.get("verdict", Outcome.MISSING))
    good = summary[Outcome.PASS.value] + summary[Outcome.WARN.value]
    said, color = f"{good} of {summary['planned']} pass", COLORS[verdict]
    if verdict not in (Outcome.PASS, Outcome.WARN):
        said = f"{verdict.value.replace('_', ' ')}: {said}"
    if shouts(results):
        said, color = "not a verdict", COLORS[Outcome.ERROR]
    left, right = (CHARACTER * len(text) + 10 for text in (LABEL, said))
    svg = _BADGE.format(
        width=left + right,
        left=left,
        right=right,
        color=color,
        label=LABEL,
        said=html.escape(said),
        label_x=left / 2,
        said_x=left + right / 2,
        title=html.escape(f"{LABEL}: {said}"),
    )
    return [write_text(folder / "badge.svg", svg)]
