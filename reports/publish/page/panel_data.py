"""What the references of a run say of themselves, gathered from its cases, and what was found out about them."""

import re
from collections.abc import Mapping
from typing import Any, TypedDict

from rayproof.reports.judge.known_defects import known_findings
from rayproof.reports.results.records import CaseRecord, FindingRecord, RunRecord

_NUMBER = re.compile(r"[\d.]+(e[-+]?\d+)?")
MOST = 40  # sentences of a reference: more are in the cases
FEW = 4  # values of a setting
MOST_VALUES = 1000  # that are counted


class SaidOfItself(TypedDict):
    """What a reference says of itself: all values of its settings, and its sentences with how often they were said."""

    settings: dict[str, list[str]]
    notes: list[tuple[str, int]]
    unsupported: list[tuple[str, int]]


class Said:
    """What the references of a run say of themselves, taken up case by case."""

    def __init__(self) -> None:
        # By reference and, with the numbers left out, sentence: the first one, and how often it was said.
        self._notes: dict[str, dict[str, tuple[str, int]]] = {}
        self._refusals: dict[str, dict[str, tuple[str, int]]] = {}
        self._settings: dict[str, dict[str, dict[str, None]]] = {}

    def add(self, case: CaseRecord) -> None:
        """Take up another case."""
        for key, word, found in (("notes", "note", self._notes), ("unsupported", "why", self._refusals)):
            for entry in _mappings(case.get(key)):
                sentence, sentences = str(entry.get(word)), found.setdefault(str(entry.get("reference")), {})
                first, count = sentences.get(alike := _NUMBER.sub("#", sentence), (sentence, 0))
                sentences[alike] = first, count + 1
        for name, used in _items(case.get("settings")):
            for key, value in _items(used):
                values = self._settings.setdefault(name, {}).setdefault(key, {})
                if len(values) < MOST_VALUES:
                    values[str(value)] = None

    @property
    def panel(self) -> dict[str, SaidOfItself]:
        """Return per reference its `settings` (name to all values), `notes` and `unsupported` with their counts."""
        return {
            name: {
                "settings": {key: _few(list(values)) for key, values in self._settings.get(name, {}).items()},
                "notes": _most(self._notes.get(name, {})),
                "unsupported": _most(self._refusals.get(name, {})),
            }
            for name in sorted({*self._notes, *self._refusals, *self._settings})
        }


def findings(results: RunRecord) -> list[FindingRecord]:
    """Return the findings that the run was judged with: its own where it recorded them, else those checked in."""
    recorded = results.get("findings")
    if isinstance(recorded, list):
        return [_without_checks(entry) for entry in recorded if isinstance(entry, Mapping)]
    return [entry.as_json() for entry in known_findings()]


def _without_checks(finding: FindingRecord) -> FindingRecord:
    left = finding.copy()
    left.pop("met", None)
    return left


def _most(sentences: Mapping[str, tuple[str, int]]) -> list[tuple[str, int]]:
    """Return the sentences that were said most often, of those that differ in numbers alone the first."""
    return sorted(sentences.values(), key=lambda entry: -entry[1])[:MOST]


def _few(values: list[str]) -> list[str]:
    """Return the first values, and how many more there are: an epsilon may differ from case to case."""
    more = " or" if len(values) == MOST_VALUES else ""
    return values if len(values) <= FEW else [*values[: FEW - 1], f"{len(values) - FEW + 1}{more} more, by case"]


def _mappings(value: Any) -> list[Mapping[str, Any]]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list) else []


def _items(value: Any) -> list[tuple[str, Any]]:
    return [(str(key), item) for key, item in value.items()] if isinstance(value, Mapping) else []
