"""The file of known failures (JSON): `KnownCheck`, `Expectation`, loading and saving.

In the file an entry is a cause, or a reason, and lists its cases; in memory an `Expectation` is about one case.
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

NO_CELLS = ("0" * 16,) * 2  # of a check without a wrong pixel
SUBJECT = "subject"  # the condition that is about who is under test; all others are about the environment
Text = Annotated[str, Meta(pattern=r"\S")]
Bound = Annotated[float, Meta(ge=0)] | Literal["inf"]  # JSON has no infinity
# Lowest and highest value. msgspec 0.22 crashes on a union of a bounded number and a tuple of fixed length.
TWO = Meta(min_length=2, max_length=2)
Bounds = Annotated[tuple[Bound, ...], TWO]
Counts = Annotated[tuple[Count, ...], TWO]
# A crash, or a check of which nothing came, is no known failure: it shows nothing.
Expectable = Literal["fail", "reference_suspect"]
EXPECTABLE: tuple[str, ...] = get_args(Expectable)


SLACK = 0.1  # of error and of wrong pixels, either way: what another processor's roundings may change


class KnownCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a check is known to fail: in the file a list of its fields, which may end before those left as they are.

    A number stands for itself with a tenth of room either way, a pair for the lowest and the highest value.
    """

    ratio: Bound | Bounds  # worst error over limit
    wrong: Count | Counts  # number of pixels over their limit
    # Mean error of these, in the stage's unit; where a limit is 0 the error over it is infinite.
    error: Bound | Bounds = (0.0, "inf")
    # Which cells of an 8 x 8 grid may hold wrong pixels, as a record's second `cells`; None: any.
    cells: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")] | None = None
    verdict: Expectable = "fail"

    def __post_init__(self) -> None:
        """Raise ValueError for a range that ends before it begins."""
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
        """Return the check that a list of the file means; raise ValueError if it means none."""
        names = cls.__struct_fields__
        if len(fields) > len(names):
            raise ValueError(f"a check has at most {len(names)} values, got {len(fields)}")
        known = dict(zip(names, fields, strict=False))
        if isinstance(known.get("cells"), str):
            known["cells"] = known["cells"].zfill(16)
        return msgspec.convert(known, cls)

    def in_short(self) -> list[Any]:
        """Return the list that the file has: without leading zeros of cells, and without what may be left out."""
        cells = None if self.cells is None else f"{int(self.cells, 16):x}"
        fields = [self.ratio, self.wrong, self.error, cells, self.verdict]
        usual = [None, None, (0.0, "inf"), None, "fail"]
        while fields[-1] == usual[len(fields) - 1]:
            fields.pop()
        return fields


def range_of(value: Bound | Bounds) -> tuple[float, float]:
    """Return the lowest and the highest value that a number or a pair stands for."""
    if isinstance(value, tuple):
        return float(value[0]), float(value[1])
    return float(value) / (1 + SLACK), float(value) * (1 + SLACK)


class Expectation(msgspec.Struct, frozen=True, kw_only=True):
    """Checks of a case that are known to fail. The case, and the words that name a check, may be patterns."""

    case: Text
    reason: Text  # why they are known to fail, for whoever reads the file
    checks: Mapping[str, KnownCheck]  # "CONFIGURATION REFERENCE STAGE" -> how it fails
    item: str | None = None  # the specification's id that is blamed in the case; None: whichever
    cause: str | None = None  # the mistake that explains the failure, by its name
    expires: str | None = None  # the last day on which it holds, as YYYY-MM-DD
    issue: str | None = None  # where it is worked on
    when: Mapping[str, str] = {}  # `subject` or a key of the environment to a pattern

    def __post_init__(self) -> None:
        """Raise ValueError for a day that is none, or a name of a check without its three words."""
        if self.expires is not None:
            date.fromisoformat(self.expires)
        for name in self.checks:
            if len(name.rsplit(" ", 2)) != 3:
                raise ValueError(f"a check is named by configuration, reference and stage, got {name!r}")

    @property
    def name(self) -> str:
        """Return what it is about, in words."""
        return f"{self.case} ({self.item})" if self.item else self.case

    @property
    def opens_more(self) -> str | None:
        """Return in words what of it is about more than the checks and pixels that it names, or None."""
        for pattern in (self.case, *self.checks):
            if re.search(r"[*?\[]", re.sub(r"\[(.)\]", "", pattern)):
                return f"{pattern!r} is a pattern"
        anywhere = next((name for name, check in self.checks.items() if check.cells is None), None)
        return None if anywhere is None else f"{anywhere!r} has no `cells`, so that pixels may be wrong anywhere"

    def about_case(self, name: str) -> bool:
        """Say whether it is about a case."""
        return fnmatchcase(name, self.case)

    def about(self, case: str, check: Check) -> str | None:
        """Return the name by which it is about a check of a case, or None."""
        if not self.about_case(case):
            return None
        words = check.configuration, check.reference, check.stage
        if (name := plainly(check.name)) in self.checks:
            return name
        return next((name for name in self.checks if all(map(fnmatchcase, words, name.rsplit(" ", 2)))), None)

    def holds_for(self, results: RunRecord) -> bool:
        """Say whether its conditions are those of a run."""
        known = {**results.get("environment", {}), SUBJECT: results.get(SUBJECT, "tracer")}
        return all(fnmatchcase(str(known.get(key, "")), pattern) for key, pattern in self.when.items())

    def expired(self, today: date) -> bool:
        """Say whether its last day is over."""
        return self.expires is not None and today > date.fromisoformat(self.expires)


class KnownFailures(msgspec.Struct, frozen=True, kw_only=True):
    """What is known to fail, and how much was answered when it was accepted."""

    suite: str = ""  # the version of rayproof that it was accepted under
    answered: Mapping[str, tuple[Count, Count]] = {}  # family -> checks that were answered, of how many
    expected: Sequence[Expectation] = ()


class EntryCase(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """An entry's case: the blamed item, and its checks in short by "CONFIGURATION REFERENCE" and stage."""

    item: str | None = None
    checks: dict[str, dict[str, list[Any]]]


class ExpectedCause(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """An entry of the file: all cases of one cause, reason and condition."""

    cause: str | None = None
    reason: Text
    expires: str | None = None
    issue: str | None = None
    when: Mapping[str, str] = {}
    cases: dict[Text, EntryCase | list[EntryCase]]  # several of a case: one for each item


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: Literal[1] = SCHEMA
    suite: str = ""
    answered: Mapping[str, tuple[Count, Count]] = {}
    expected: Sequence[ExpectedCause] = ()


def entries(known: KnownFailures) -> list[ExpectedCause]:
    """Return the file's entries: expectations of one cause, reason and condition together."""
    found: list[ExpectedCause] = []
    for expectation in known.expected:
        about = {key: getattr(expectation, key) for key in ("cause", "reason", "expires", "issue", "when")}
        alike = (entry for entry in found if all(getattr(entry, key) == value for key, value in about.items()))
        if (entry := next(alike, None)) is None:
            found.append(entry := ExpectedCause(**about, cases={}))
        groups: dict[str, dict[str, list[Any]]] = {}
        for name, check in expectation.checks.items():
            pair, _, stage = name.rpartition(" ")
            groups.setdefault(pair, {})[stage] = check.in_short()
        case, before = EntryCase(item=expectation.item, checks=groups), entry.cases.get(expectation.case)
        several = [] if before is None else before if isinstance(before, list) else [before]
        entry.cases[expectation.case] = [*several, case] if several else case
    return found


def _expectations(entry: ExpectedCause) -> list[Expectation]:
    """Return an entry's expectations, one for each case and item."""
    about = {key: getattr(entry, key) for key in ("cause", "reason", "expires", "issue", "when")}
    found = []
    for name, cases in entry.cases.items():
        for case in cases if isinstance(cases, list) else [cases]:
            checks = {}
            for pair, group in case.checks.items():
                for stage, fields in group.items():
                    try:
                        checks[f"{pair} {stage}"] = KnownCheck.of(fields)
                    except ValueError as error:
                        raise ValueError(f"{name}: {pair} {stage}: {error}") from None
            found.append(Expectation(case=name, item=case.item, checks=checks, **about))
    return found


def plainly(name: str) -> str:
    """Return a pattern that means the name and nothing else."""
    return "".join(f"[{character}]" if character in "*?[" else character for character in name)


def load_known(path: Path, *, patterns: bool) -> KnownFailures:
    """Return the known failures in a file; entries with `patterns` are refused unless they are allowed.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no such file; the message names the file, the place and what is wrong there.

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
    except ValueError as error:  # msgspec's is one
        raise ValueError(f"{path}: {error}") from None
    known = KnownFailures(suite=file.suite, answered=file.answered, expected=expected)
    for entry in known.expected:
        if not patterns and (more := entry.opens_more) is not None:
            raise ValueError(f"{path}: the entry of {entry.name}: {more}; --any allows such entries")
    return known


def save_known(path: Path, known: KnownFailures) -> None:
    """Write a file of known failures, the checks of a case and a reference on one line."""
    short: list[str] = []

    def one_line(value: Any) -> str:
        short.append(as_json(value))
        return f"\0{len(short) - 1}"

    def in_lines(case: EntryCase) -> dict[str, Any]:
        checks = {pair: one_line(group) for pair, group in case.checks.items()}
        return {"item": case.item, "checks": checks} if case.item else {"checks": checks}

    content = {
        "schema": SCHEMA,
        "suite": known.suite,
        "answered": {family: one_line(counts) for family, counts in known.answered.items()},
        "expected": [
            {
                **{key: value for key, value in msgspec.structs.asdict(entry).items() if value and key != "cases"},
                "cases": {
                    name: [*map(in_lines, case)] if isinstance(case, list) else in_lines(case)
                    for name, case in entry.cases.items()
                },
            }
            for entry in entries(known)
        ],
    }
    text = re.sub(r'"\\u0000(\d+)"', lambda place: short[int(place[1])], as_json(content, indent=1))
    write_text(path, f"{text}\n")
