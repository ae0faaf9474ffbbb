"""What the references of a run say of themselves, gathered from its cases, and what was found out about them."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from rayproof.reports.judge.panel.known_defects import known_findings
from rayproof.reports.results.records import CaseRecord, RunRecord

_NUMBER = re.compile(r"[\d.]+(e[-+]?\d+)?")
MOST = 40  # sentences of a reference: more are in the cases
FEW = 4  # values of a setting


def panel(cases: Iterable[CaseRecord]) -> dict[str, dict[str, Any]]:
    """Return per reference its `settings` (name to all values in use), `notes` and `unsupported` with their counts."""
    notes: dict[str, Counter[str]] = {}
    refusals: dict[str, Counter[str]] = {}
    settings: dict[str, dict[str, dict[str, None]]] = {}
    for case in cases:
        for entry in _mappings(case.get("notes")):
            notes.setdefault(str(entry.get("reference")), Counter())[str(entry.get("note"))] += 1
        for entry in _mappings(case.get("unsupported")):
            refusals.setdefault(str(entry.get("reference")), Counter())[str(entry.get("why"))] += 1
        for name, used in _items(case.get("settings")):
            for key, value in _items(used):
                settings.setdefault(name, {}).setdefault(key, {})[str(value)] = None
    return {
        name: {
            "settings": {key: _few(list(values)) for key, values in settings.get(name, {}).items()},
            "notes": _alike(notes.get(name, Counter())),
            "unsupported": _alike(refusals.get(name, Counter())),
        }
        for name in sorted({*notes, *refusals, *settings})
    }


def findings(results: RunRecord) -> list[dict[str, Any]]:
    """Return the findings that the run was judged with: its own where it recorded them, else those checked in."""
    recorded = results.get("findings")
    if isinstance(recorded, list):
        return [dict(entry) for entry in _mappings(recorded)]
    return [asdict(entry) for entry in known_findings()]


def _alike(sentences: Counter[str]) -> list[tuple[str, int]]:
    """Return the sentences that differ in more than numbers, the first of each, and how often it was said."""
    first: dict[str, str] = {}
    counts: Counter[str] = Counter()
    for sentence, count in sentences.items():
        counts[first.setdefault(_NUMBER.sub("#", sentence), sentence)] += count
    return counts.most_common(MOST)


def _few(values: list[str]) -> list[str]:
    """Return the first values, and how many more there are: an epsilon may differ from case to case."""
    return values if len(values) <= FEW else [*values[: FEW - 1], f"{len(values) - FEW + 1} more, by case"]


def _mappings(value: Any) -> list[Mapping[str, Any]]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list) else []


def _items(value: Any) -> list[tuple[str, Any]]:
    return [(str(key), item) for key, item in value.items()] if isinstance(value, Mapping) else []
