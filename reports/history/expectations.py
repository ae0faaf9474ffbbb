"""The file of known failures (JSON): `KnownCheck`, `Expectation`, loading and saving."""

import re
from collections.abc import Mapping, Sequence
from datetime import date
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal, get_args

import msgspec
from msgspec import Meta

from rayproof.reports.results.case_records import Check, Count
from rayproof.reports.results.files import SCHEMA, as_json, write_text
from rayproof.reports.results.records import RunRecord

NO_CELLS = ("0" * 16,) * 2  # of a check without a wrong pixel
SUBJECT = "subject"  # the condition that is about who is under test; all others are about the environment
Text = Annotated[str, Meta(pattern=r"\S")]
Bound = Annotated[float, Meta(ge=0)] | Literal["inf"]  # JSON has no infinity
# A crash, or a check of which nothing came, is no known failure: it shows nothing.
Expectable = Literal["fail", "reference_suspect"]
EXPECTABLE: tuple[str, ...] = get_args(Expectable)


class KnownCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """How a check is known to fail."""

    verdict: Expectable
    ratio: tuple[Bound, Bound]  # lowest and highest worst error over limit
    wrong: tuple[Count, Count]  # lowest and highest number of pixels over their limit
    # Lowest and highest mean error of these, in the stage's unit; where a limit is 0 the error over it is infinite.
    error: tuple[Bound, Bound] = (0.0, "inf")
    # Which cells of an 8 x 8 grid may hold wrong pixels, as a record's second `cells`; None: any.
    cells: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")] | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for a range that ends before it begins."""
        for key, (low, high) in (("ratio", self.ratio), ("wrong", self.wrong), ("error", self.error)):
            if not float(low) <= float(high):
                raise ValueError(f"{key} must begin with the lowest, got {[low, high]}")


class Expectation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Checks of a case that are known to fail. The case, and the words that name a check, may be patterns."""

    case: Text
    reason: Text  # why they are known to fail, for whoever reads the file
    checks: Mapping[str, KnownCheck]  # "CONFIGURATION REFERENCE STAGE" -> how it fails
    item: str | None = None  # the specification's id that is blamed in the case; None: whichever
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


class Known(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The file: what is known to fail, and how much was answered when it was accepted."""

    schema: Literal[1] = SCHEMA
    suite: str = ""  # the version of rayproof that it was accepted under
    answered: Mapping[str, tuple[Count, Count]] = {}  # family -> checks that were answered, of how many
    expected: Sequence[Expectation] = ()


def plainly(name: str) -> str:
    """Return a pattern that means the name and nothing else."""
    return "".join(f"[{character}]" if character in "*?[" else character for character in name)


def load_known(path: Path, *, patterns: bool) -> Known:
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
        known = msgspec.convert(content, Known)
    except msgspec.ValidationError as error:
        raise ValueError(f"{path}: {error}") from None
    for entry in known.expected:
        if not patterns and (more := entry.opens_more) is not None:
            raise ValueError(f"{path}: the entry of {entry.name}: {more}; --any allows such entries")
    return known


def save_known(path: Path, known: Known) -> None:
    """Write a file of known failures, each check on a line of its own."""
    text = as_json(msgspec.to_builtins(known), indent=1)
    for kind in (r"\[\n[^][{}]*\]", r"\{\n[^{}]*\}"):  # lists and objects with nothing of their kind in them
        text = re.sub(kind, lambda found: re.sub(r"\s*\n\s*", " ", found[0]), text)
    write_text(path, f"{text}\n")
