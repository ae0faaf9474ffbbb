"""The file of known failures (JSON): `KnownCheck`, `Expectation`, loading and saving.

An entry of the file has a cause or a reason and lists its cases; in memory, an `Expectation` belongs to one case.
"""

import math
import re
from collections.abc import Mapping, Sequence
from datetime import date
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import msgspec
from msgspec import Meta

from rayproof.reports.results.case_records import Check, Count
from rayproof.reports.results.files import SCHEMA, as_json, write_text
from rayproof.reports.results.records import RunRecord

NO_CELLS = ("0" * 16,) * 2  # the cells of a check without wrong pixels
SUBJECT = "subject"  # the condition on the renderer under test; all others are conditions on the environment
Text = Annotated[str, Meta(pattern=r"\S")]
Bound = Annotated[float, Meta(ge=0)] | Literal["inf"]  # JSON has no infinity
# Lowest and highest value. msgspec 0.22 crashes on a union of a bounded number and a tuple of fixed length.
TWO = Meta(min_length=2, max_length=2)
Bounds = Annotated[tuple[Bound, ...], TWO]
Counts = Annotated[tuple[Count, ...], TWO]
# A crash or a check without a result cannot be a known failure, since it does not show whether the failure is still
# there.
Expectable = Literal["fail", "reference_suspect"]
EXPECTABLE: tuple[str, ...] = get_args(Expectable)


SLACK = 0.1  # relative tolerance of errors and numbers of wrong pixels, which another processor's rounding may change


class KnownCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The known failure of a check; in the file, a list of its fields, without trailing fields that have defaults.

    A single number allows a tolerance of a tenth in both directions; a pair is the lowest and the highest value.
    """

    ratio: Bound | Bounds  # largest error over limit
    wrong: Count | Counts  # number of pixels over their limit
    # Mean error of these pixels, in the stage's unit; the ratio is infinite if a limit is 0.
    error: Bound | Bounds = (0.0, "inf")
    # The cells of an 8 x 8 grid that may contain wrong pixels, as a record's second `cells`; None allows any.
    cells: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")] | None = None
    verdict: Expectable = "fail"

    def __post_init__(self) -> None:
        """Raise ValueError for a range whose lowest value exceeds its highest."""
        for key, (low, high) in zip(("ratio", "wrong", "error"), self.ranges, strict=True):
            if not low <= high:
                raise ValueError(f"{key} must begin with the lowest, got {[low, high]}")

    @property
    def pixels(self) -> tuple[int, int]:
        """Return the lowest and the highest number of wrong pixels."""
        if not isinstance(self.wrong, int):
            return self.wrong[0], self.wrong[1]
        return math.floor(self.wrong / (1 + SLACK)), math.ceil(self.wrong * (1 + SLACK))

    @property
    def ranges(self) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Return the lowest and the highest ratio, number of wrong pixels and mean error."""
        return range_of(self.ratio), self.pixels, range_of(self.error)

    @classmethod
    def of(cls, fields: Sequence[Any]) -> "KnownCheck":
        """Return the check from a list of the file; raise ValueError if the list is invalid."""
        names = cls.__struct_fields__
        if len(fields) > len(names):
            raise ValueError(f"a check has at most {len(names)} values, got {len(fields)}")
        values = dict(zip(names, fields, strict=False))
        if isinstance(values.get("cells"), str):
            values["cells"] = values["cells"].zfill(16)
        return msgspec.convert(values, cls)

    def in_short(self) -> list[Any]:
        """Return the check as a list for the file, without leading zeros of cells and without trailing defaults."""
        cells = None if self.cells is None else f"{int(self.cells, 16):x}"
        fields = [self.ratio, self.wrong, self.error, cells, self.verdict]
        usual = [None, None, (0.0, "inf"), None, "fail"]
        while fields[-1] == usual[len(fields) - 1]:
            fields.pop()
        return fields


def range_of(value: Bound | Bounds) -> tuple[float, float]:
    """Return the lowest and the highest value that a number or a pair allows."""
    if isinstance(value, tuple):
        return float(value[0]), float(value[1])
    return float(value) / (1 + SLACK), float(value) * (1 + SLACK)


class Expectation(msgspec.Struct, frozen=True, kw_only=True):
    """The checks of a case that are known to fail. The case and the three words of a check may be patterns."""

    case: Text
    reason: Text  # the reason of the failure, for readers of the file
    checks: Mapping[str, KnownCheck]  # "CONFIGURATION REFERENCE STAGE" -> the known failure
    item: str | None = None  # the item of the specification that is blamed in the case; None allows any
    cause: str | None = None  # the name of the mistake that explains the failure
    expires: str | None = None  # the last day on which the expectation is valid, as YYYY-MM-DD
    issue: str | None = None  # a link to the issue
    when: Mapping[str, str] = {}  # `subject` or a key of the environment -> a pattern of its value

    def __post_init__(self) -> None:
        """Raise ValueError for an invalid date, or for a check's name that does not have three words."""
        if self.expires is not None:
            date.fromisoformat(self.expires)
        for name in self.checks:
            if len(name.rsplit(" ", 2)) != 3:
                raise ValueError(f"a check is named by configuration, reference and stage, got {name!r}")

    @property
    def name(self) -> str:
        """Return the case's name, with the blamed item if there is one."""
        return f"{self.case} ({self.item})" if self.item else self.case

    @property
    def opens_more(self) -> str | None:
        """Return the part that allows more than named checks and pixels, such as a pattern, as a sentence, or None."""
        for pattern in (self.case, *self.checks):
            if re.search(r"[*?\[]", re.sub(r"\[(.)\]", "", pattern)):
                return f"{pattern!r} is a pattern"
        anywhere = next((name for name, check in self.checks.items() if check.cells is None), None)
        return None if anywhere is None else f"{anywhere!r} has no `cells`, so that pixels may be wrong anywhere"

    def about_case(self, name: str) -> bool:
        """Return whether the expectation applies to a case."""
        return fnmatchcase(name, self.case)

    def about(self, case: str, check: Check) -> str | None:
        """Return the key in `checks` that matches a check of a case, or None."""
        if not self.about_case(case):
            return None
        words = check.configuration, check.reference, check.stage
        if (name := plainly(check.name)) in self.checks:
            return name
        return next((name for name in self.checks if all(map(fnmatchcase, words, name.rsplit(" ", 2)))), None)

    def holds_for(self, results: RunRecord) -> bool:
        """Return whether a run meets all conditions of the expectation."""
        facts = {**results.get("environment", {}), SUBJECT: results.get(SUBJECT, "tracer")}
        return all(fnmatchcase(str(facts.get(key, "")), pattern) for key, pattern in self.when.items())

    def expired(self, today: date) -> bool:
        """Return whether the last valid day is over."""
        return self.expires is not None and today > date.fromisoformat(self.expires)


class KnownFailures(msgspec.Struct, frozen=True, kw_only=True):
    """The known failures, and the number of answered checks at their acceptance."""

    suite: str = ""  # the version of rayproof with which they were accepted
    answered: Mapping[str, tuple[Count, Count]] = {}  # family -> number of answered checks, number of planned checks
    expected: Sequence[Expectation] = ()


class EntryCase(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A case of an entry: the blamed item, and the checks as lists by "CONFIGURATION REFERENCE" and stage."""

    item: str | None = None
    checks: dict[str, dict[str, list[Any]]]


class ExpectedCause(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """An entry of the file: all cases with the same cause, reason and conditions."""

    cause: str | None = None
    reason: Text
    expires: str | None = None
    issue: str | None = None
    when: Mapping[str, str] = {}
    cases: dict[Text, EntryCase | list[EntryCase]]  # a list if the case has several blamed items


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: Literal[1] = SCHEMA
    suite: str = ""
    answered: Mapping[str, tuple[Count, Count]] = {}
    expected: Sequence[ExpectedCause] = ()


def entries(known_failures: KnownFailures) -> list[ExpectedCause]:
    """Return the entries for the file, which group expectations with the same cause, reason and conditions."""
    file_entries: list[ExpectedCause] = []
    for expectation in known_failures.expected:
        about = {key: getattr(expectation, key) for key in ("cause", "reason", "expires", "issue", "when")}
        alike = (entry for entry in file_entries if all(getattr(entry, key) == value for key, value in about.items()))
        if (entry := next(alike, None)) is None:
            file_entries.append(entry := ExpectedCause(**about, cases={}))
        groups: dict[str, dict[str, list[Any]]] = {}
        for name, check in expectation.checks.items():
            pair, _, stage = name.rpartition(" ")
            groups.setdefault(pair, {})[stage] = check.in_short()
        case, before = EntryCase(item=expectation.item, checks=groups), entry.cases.get(expectation.case)
        several = [] if before is None else before if isinstance(before, list) else [before]
        entry.cases[expectation.case] = [*several, case] if several else case
    return file_entries


def _expectations(entry: ExpectedCause) -> list[Expectation]:
    """Return an entry's expectations, one for each case and item."""
    about = {key: getattr(entry, key) for key in ("cause", "reason", "expires", "issue", "when")}
    expectations = []
    for name, cases in entry.cases.items():
        for case in cases if isinstance(cases, list) else [cases]:
            checks = {}
            for pair, group in case.checks.items():
                for stage, fields in group.items():
                    try:
                        checks[f"{pair} {stage}"] = KnownCheck.of(fields)
                    except ValueError as error:
                        raise ValueError(f"{name}: {pair} {stage}: {error}") from None
            expectations.append(Expectation(case=name, item=case.item, checks=checks, **about))
    return expectations


def plainly(name: str) -> str:
    """Return a pattern that matches only this name."""
    return "".join(f"[{character}]" if character in "*?[" else character for character in name)


def load_known(path: Path, *, patterns: bool) -> KnownFailures:
    """Return the known failures in a file; `patterns` allows entries that match more than named checks and pixels.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is invalid, or has such an entry without `patterns`; the message names file and place.

    """
    try:
        content = msgspec.json.decode(path.read_bytes())
    except msgspec.DecodeError as error:
        raise ValueError(f"{path} is no JSON: {error}") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise ValueError(f"{path} must be an object with schema {SCHEMA}; `rayproof gate accept` writes one")
    try:
        file = msgspec.convert(content, _File)
        expected = [expectation for entry in file.expected for expectation in _expectations(entry)]
    except ValueError as error:  # also msgspec.ValidationError
        raise ValueError(f"{path}: {error}") from None
    known_failures = KnownFailures(suite=file.suite, answered=file.answered, expected=expected)
    for entry in known_failures.expected:
        if not patterns and (more := entry.opens_more) is not None:
            raise ValueError(f"{path}: the entry of {entry.name}: {more}; --any allows such entries")
    return known_failures


def save_known(path: Path, known_failures: KnownFailures) -> None:
    """Write a file of known failures, with the checks of a configuration and a reference on one line."""
    short: list[str] = []

    def one_line(value: Any) -> str:
        short.append(as_json(value))
        return f"\0{len(short) - 1}"

    def in_lines(case: EntryCase) -> dict[str, Any]:
        checks = {pair: one_line(group) for pair, group in case.checks.items()}
        return {"item": case.item, "checks": checks} if case.item else {"checks": checks}

    content = {
        "schema": SCHEMA,
        "suite": known_failures.suite,
        "answered": {family: one_line(counts) for family, counts in known_failures.answered.items()},
        "expected": [
            {
                **{key: value for key, value in msgspec.structs.asdict(entry).items() if value and key != "cases"},
                "cases": {
                    name: [*map(in_lines, case)] if isinstance(case, list) else in_lines(case)
                    for name, case in entry.cases.items()
                },
            }
            for entry in entries(known_failures)
        ],
    }
    text = re.sub(r'"\\u0000(\d+)"', lambda place: short[int(place[1])], as_json(content, indent=1))
    write_text(path, f"{text}\n")
