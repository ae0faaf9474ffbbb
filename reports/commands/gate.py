"""`rayproof gate`: accept or prune known failures, or check a run against them."""

from collections.abc import Sequence
from datetime import date
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter
from msgspec import structs

from rayproof.reports.commands.lookup import Repeated
from rayproof.reports.commands.output import say, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line
from rayproof.reports.results.files import legible, several

if TYPE_CHECKING:
    from rayproof.reports.history.expectations import KnownFailures
    from rayproof.reports.results.records import RunRecord

FILE = Path("known.json")
SHUT = 1  # exit code of `check` if the gate is red
MOST = 8  # printed lines of a list; a command prints ten with the count of the rest and the summary


app = App(name="gate", help="Keep a file of known failures for `rayproof run --expect`, and check a run against it.")
# Options that the three commands share.
Patterns = Annotated[bool, Parameter(name="--any")]


@app.command
def accept(
    folder: Path,
    *selectors: str,
    file: Path = FILE,
    patterns: Patterns = False,
    reason: str | None = None,
    cause: str | None = None,
    expires: str | None = None,
    issue: str | None = None,
    when: Repeated = (),
    json: Path | None = None,
) -> int:
    """Add a run's failing checks that have no entry yet to the file, and record how many checks the renderer answers.

    For example: rayproof gate accept report --reason "Mitsuba draws sheared spheres wrong."

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.
    selectors
        Families, cases or patterns such as `shadows/*`; only their failing checks are accepted. Default: all.
    file
        The file of known failures.
    patterns
        Allow entries of the file to name cases and checks by patterns, such as shadows/*, or to omit the positions of
        wrong pixels. Without this option such a file is refused.
    reason
        The reason why these checks fail. Default with --cause: the diagnosis' sentence about the cause.
    cause
        A mistake that the run's diagnosis names: accept the failing checks of all cases that this mistake explains.
    expires
        The last day on which the new entries are valid, such as 2027-01-31.
    issue
        A link to the issue.
    when
        A condition of the new entries, KEY=PATTERN, where KEY is `subject` or a key of the run's environment such as
        `backend`. Repeatable.
    json
        Also write the result to this file.

    """
    from rayproof.reports.history.expectations import KnownFailures, entries, save_known
    from rayproof.reports.history.gating import Acceptance, accepted

    results, known_failures = _run_and_file(folder, file, patterns=patterns, absent=KnownFailures())
    with told_in_one_line():
        if expires is not None:
            date.fromisoformat(expires)
        conditions = dict(_condition(text) for text in when)
        sentence = None if cause is None else _sentence_of(results, cause)
        cases = _failing(results, selectors)
    acceptance = Acceptance(
        reason=reason or sentence or "", cases=cases, cause=cause, expires=expires, issue=issue, when=conditions
    )
    more, new, refused = accepted(results, known_failures, acceptance)
    if new and not acceptance.reason.strip():
        raise UsageError(f"accept needs --reason, which says why these {new} checks fail")
    with told_in_one_line():
        save_known(file, more)
    _listed([f"not accepted: {sentence}" for sentence in refused])
    count = len(entries(more))
    say(f"{several(new, 'failing check')} accepted; {count} {'entry' if count == 1 else 'entries'} in {file}")
    write_json(json, {"file": str(file), "entries": count, "accepted": new, "refused": refused})
    return 0


@app.command
def prune(folder: Path, *, file: Path = FILE, patterns: Patterns = False, json: Path | None = None) -> int:
    """Remove checks that now pass from the file, and narrow the other entries; nothing is added or widened.

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.
    file
        The file of known failures.
    patterns
        Allow entries of the file to name cases and checks by patterns. Without this option such a file is refused.
    json
        Also write the result to this file.

    """
    from rayproof.reports.history.expectations import entries, save_known
    from rayproof.reports.history.gating import pruned

    results, known_failures = _run_and_file(folder, file, patterns=patterns)
    left, done = pruned(results, known_failures)
    with told_in_one_line():
        save_known(file, left)
    _listed(done)
    count = len(entries(left))
    say(f"{len(left.expected)} of {several(len(known_failures.expected), 'case')} in {file} stay, in {count} entries")
    write_json(json, {"file": str(file), "entries": count, "done": done})
    return 0


@app.command
def check(
    folder: Path,
    *,
    file: Path = FILE,
    patterns: Patterns = False,
    against: Path | None = None,
    least_coverage: float | None = None,
    json: Path | None = None,
) -> int:
    """Check a run against the file, as `rayproof run --expect` does, and exit with 1 if the gate is red.

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.
    file
        The file of known failures.
    patterns
        Allow entries of the file to name cases and checks by patterns. Without this option such a file is refused.
    against
        An earlier run's folder, or a history file; the gate is also red if a check became worse than there.
    least_coverage
        The smallest share [%] of the cases that must be answered.
    json
        Also write the result to this file.

    """
    from rayproof.reports.history.gating import Demanded, held, load_base
    from rayproof.reports.results.records import SHUTTING

    results, known_failures = _run_and_file(folder, file, patterns=patterns)
    with told_in_one_line():
        base = None if against is None else load_base(against)
    demanded = Demanded(expected=(str(file), known_failures), against=base, least_coverage=least_coverage)
    outcome = held(results, demanded)
    _listed([f"{key}: {sentence}" for key in SHUTTING for sentence in getattr(outcome, key)])
    say(outcome.sentence)
    write_json(json, outcome.record())
    return SHUT if outcome.red else 0


def _run_and_file(
    folder: Path, file: Path, *, patterns: bool, absent: "KnownFailures | None" = None
) -> "tuple[RunRecord, KnownFailures]":
    """Return a run's results and the known failures of a file, or `absent` if the file does not exist."""
    from rayproof.reports.history.expectations import load_known
    from rayproof.reports.results.document import load_results

    with told_in_one_line():
        results = load_results(folder)
        known_failures = load_known(file, patterns=patterns) if absent is None or file.exists() else absent
    return results, structs.replace(known_failures, suite=f"rayproof {results.get('rayproof', '')}".strip())


def _failing(results: "RunRecord", selectors: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the run's failing cases that selectors match; raise ValueError if a selector matches none."""
    from rayproof.reports.history.gating import GOOD

    failing = [case for case in results["cases"] if case["verdict"] not in GOOD]
    names: dict[str, None] = {}
    for selector in selectors:
        chosen = [
            case["name"]
            for case in failing
            if selector in (case["name"], case["family"]) or fnmatchcase(case["name"], selector)
        ]
        if not chosen:
            raise ValueError(f"no failing case of the run matches {legible(selector)}")
        names |= dict.fromkeys(chosen)
    return tuple(names)


def _sentence_of(results: "RunRecord", cause: str) -> str:
    """Return the diagnosis' sentence about a cause; raise ValueError if the run's diagnosis does not name the cause."""
    sentences = {
        str(entry["mistake"]): entry["sentence"] for entry in results.get("diagnosis") or () if entry["mistake"]
    }
    if cause not in sentences:
        named = f"it names {', '.join(map(legible, sentences))}" if sentences else "it names none"
        raise ValueError(f"the run's diagnosis names no cause {legible(cause)}; {named}")
    return sentences[cause]


def _listed(lines: Sequence[str]) -> None:
    """Print the first `MOST` lines, and the number of the remaining ones."""
    for line in lines[:MOST]:
        say(line)
    if len(lines) > MOST:
        say(f"and {len(lines) - MOST} more; --json FILE writes them all")


def _condition(text: str) -> tuple[str, str]:
    key, equals, pattern = text.partition("=")
    if not key or not equals:
        raise ValueError(f"--when must be KEY=PATTERN, such as backend=llvm, got {text!r}")
    return key, pattern
