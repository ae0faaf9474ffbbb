"""The file of expectations: JSON, one entry for each check that is known to fail, or for a pattern of them."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import date
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from rayproof.reports.results.case_records import CheckRecord
from rayproof.reports.results.files import as_json, write_text
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

SCHEMA = 1
# A crash, or a check of which nothing came, is no known failure: it shows nothing.
EXPECTABLE = (Outcome.FAIL, Outcome.REFERENCE_SUSPECT)
SUBJECT = "subject"  # the condition that is about who is under test; all others are about the environment


@dataclass(frozen=True, kw_only=True)
class Expectation:
    """Checks that are known to fail, and how. `case`, `configuration`, `reference` and `stage` may be patterns."""

    case: str
    configuration: str
    reference: str
    stage: str
    verdict: str  # fail or reference_suspect
    reason: str  # why it is known to fail, for whoever reads the file
    ratio: tuple[float, float]  # lowest and highest worst error over limit; infinities are allowed
    wrong: tuple[int, int]  # lowest and highest number of pixels over their limit
    item: str | None = None  # the specification's id that is blamed in the case; None: whichever
    expires: str | None = None  # the last day on which it holds, as YYYY-MM-DD
    issue: str | None = None  # where it is worked on
    when: Mapping[str, str] = field(default_factory=dict)  # `subject` or a key of the environment to a pattern

    @property
    def name(self) -> str:
        """Return the checks that it is about, in words."""
        return f"{self.case} {self.configuration} {self.reference} {self.stage}"

    def about_case(self, name: str) -> bool:
        """Say whether it is about a case."""
        return fnmatchcase(name, self.case)

    def about(self, case: str, check: CheckRecord) -> bool:
        """Say whether it is about a check of a case."""
        named = ((check[key], getattr(self, key)) for key in ("configuration", "reference", "stage"))
        return self.about_case(case) and all(fnmatchcase(str(value), pattern) for value, pattern in named)

    def holds_for(self, results: RunRecord) -> bool:
        """Say whether its conditions are those of a run."""
        known = {**results.get("environment", {}), SUBJECT: results.get(SUBJECT, "tracer")}
        return all(fnmatchcase(str(known.get(key, "")), pattern) for key, pattern in self.when.items())

    def expired(self, today: date) -> bool:
        """Say whether its last day is over."""
        return self.expires is not None and today > date.fromisoformat(self.expires)


def load_expectations(path: Path) -> tuple[Expectation, ...]:
    """Return the expectations in a file.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no file of expectations; the message names the file, the entry and what is wrong there.

    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is no JSON: {error}") from None
    if (
        not isinstance(content, dict)
        or content.get("schema") != SCHEMA
        or not isinstance(content.get("expected"), list)
    ):
        raise ValueError(f"{path} must be an object with schema {SCHEMA} and a list `expected`")
    found = []
    for number, entry in enumerate(content["expected"]):
        try:
            found.append(_entry(entry))
        except (ValueError, TypeError) as error:
            raise ValueError(f"{path}, entry {number}: {error}") from None
    return tuple(found)


def save_expectations(path: Path, expected: tuple[Expectation, ...], suite: str) -> None:
    """Write a file of expectations; `suite` names the version of rayproof that they were accepted under."""
    entries = [{key: value for key, value in asdict(one).items() if value not in (None, {})} for one in expected]
    write_text(path, as_json({"schema": SCHEMA, "suite": suite, "expected": entries}, indent=1) + "\n")


def _entry(entry: Any) -> Expectation:
    if not isinstance(entry, dict):
        raise TypeError(f"must be an object, got {type(entry).__name__}")
    known = {one.name for one in fields(Expectation)}
    if unknown := sorted(set(map(str, entry)) - known):
        raise ValueError(f"unknown key {unknown[0]!r}; known: {', '.join(sorted(known))}")
    text: dict[str, str] = {}
    for key in ("case", "configuration", "reference", "stage", "verdict", "reason"):
        value = entry.get(key)
        if not isinstance(value, str) or not value.strip():
            raise ValueError(f"{key} must be a text that says something, got {value!r}")
        text[key] = value
    if text["verdict"] not in EXPECTABLE:
        raise ValueError(f"verdict must be one of {', '.join(EXPECTABLE)}, got {text['verdict']!r}")
    for key in ("item", "expires", "issue"):
        if entry.get(key) is not None and not isinstance(entry[key], str):
            raise ValueError(f"{key} must be a text, got {entry[key]!r}")
    if entry.get("expires") is not None:
        date.fromisoformat(entry["expires"])
    when = entry.get("when", {})
    if not isinstance(when, dict) or not all(isinstance(one, str) for pair in when.items() for one in pair):
        raise ValueError("when must be an object of texts")
    ratio, wrong = (_range(entry.get(key), key) for key in ("ratio", "wrong"))
    return Expectation(
        **text,
        item=entry.get("item"),
        expires=entry.get("expires"),
        issue=entry.get("issue"),
        ratio=ratio,
        wrong=(int(wrong[0]), int(wrong[1])),
        when=when,
    )


def _range(value: Any, key: str) -> tuple[float, float]:
    """Return the lowest and highest of a range; `"inf"` is how JSON carries an infinity here."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{key} must be a list of the lowest and the highest, got {value!r}")
    numbers = [math.inf if one == "inf" else one for one in value]
    if not all(isinstance(one, int | float) and not isinstance(one, bool) and one >= 0 for one in numbers):
        raise ValueError(f"{key} must be numbers from 0 on, got {value!r}")
    low, high = numbers
    if not low <= high:
        raise ValueError(f"{key} must begin with the lowest, got {value!r}")
    if key == "wrong" and not all(float(one).is_integer() for one in numbers):
        raise ValueError(f"wrong must be whole numbers of pixels, got {value!r}")
    return low, high
