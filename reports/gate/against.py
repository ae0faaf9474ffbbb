"""Hold a finished run against an earlier one, or against the history of runs: what became worse is red.

Against a folder it is verdicts and errors, check by check. Of its times there is no control, because each render was
timed once and at another hour. Against a history times count too, in standard deviations of the earlier runs on the
same machine, as `reports.runs.history.standing` has it.
"""

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rayproof.reports.results.document import load_results
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.reports.runs.difference.checks import LEAST_RATIO, ORDER, compared, paired
from rayproof.reports.runs.history.database import append, opened
from rayproof.reports.runs.history.revisions import revision
from rayproof.reports.runs.history.series import WORSE_ERROR, read_series
from rayproof.reports.runs.history.standing import worse

GOOD = (Outcome.PASS, Outcome.WARN, Outcome.UNDECIDED, Outcome.UNSUPPORTED)
SHOW_NOTHING = (Outcome.ERROR, Outcome.MISSING)


@dataclass(frozen=True, kw_only=True)
class Base:
    """What a run is held against: the results of an earlier one, or a file with a history."""

    name: str  # as the user wrote it
    results: RunRecord | None  # None: a history


def load_base(path: Path) -> Base:
    """Return the run in a folder, or the history in a file.

    Raises:
        OSError, ValueError: it is neither; the message names the file.

    """
    if path.is_dir():
        return Base(name=str(path), results=load_results(path))
    with opened(path):
        pass  # it is one, and can be read
    return Base(name=str(path), results=None)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """How a run stands before an earlier one, in sentences that begin with the case."""

    worse: list[str]
    as_before: list[str]  # what fails, and did not become worse
    cases: list[str]  # names of cases that fail, and in which nothing became worse


def standing(results: RunRecord, base: Base) -> Standing:
    """Return what became worse since `base`, and what fails as it did."""
    return _before_history(results, base) if base.results is None else _before_run(results, base.name, base.results)


def _before_run(results: RunRecord, name: str, earlier: RunRecord) -> Standing:
    known = {case["name"]: case for case in earlier["cases"]}
    pairs = paired(*([str(one) for one in run.get("configurations", ())] for run in (earlier, results)))
    found, same, cases = [], [], []
    for case in results["cases"]:
        before = known.get(case["name"])
        told, kept = [], []
        if before is None:
            told = [f"{case['verdict']}, and {name} does not have it"] if case["verdict"] not in GOOD else []
        else:
            for row in compared(before, case, pairs):
                where = f"{row['configuration']} {row['reference']} {row['stage']}"
                said = _worse(row)
                told += [f"{where}: {said}"] if said else []
                if not said and row["after"] is not None and row["after"][0] not in GOOD:
                    kept.append(f"{where}: {row['after'][0]}, as in {name}")
            if not told and not kept and ORDER.index(case["verdict"]) > ORDER.index(before["verdict"]):
                told = [f"{case['verdict']}, was {before['verdict']}"]
        found += [f"{case['name']}: {sentence}" for sentence in told]
        same += [f"{case['name']}: {sentence}" for sentence in kept]
        if case["verdict"] not in GOOD and not told:
            cases.append(case["name"])
    return Standing(worse=found, as_before=same, cases=cases)


def _worse(row: Mapping[str, Any]) -> str | None:
    """Return in words how a check became worse, or None."""
    before, after = row["before"], row["after"]
    if after is None:
        return f"was {before[0]}, and is not made any more"
    if before is None:
        return f"{after[0]}, and was not made before" if after[0] not in GOOD else None
    # A crash shows less than a failure, though it is no worse a verdict.
    if ORDER.index(after[0]) > ORDER.index(before[0]) or (after[0] in SHOW_NOTHING and after[0] != before[0]):
        return f"{after[0]}, was {before[0]}"
    if before[1] is None or after[1] is None or after[1] < LEAST_RATIO or after[1] <= WORSE_ERROR * before[1]:
        return None
    return f"worst error / limit {after[1]:.3g}, was {before[1]:.3g}"


def _before_history(results: RunRecord, base: Base) -> Standing:
    """Return how a run stands in a history, of which a copy takes it up: the file itself is `--history`'s to write."""
    with tempfile.TemporaryDirectory(prefix="rayproof-against-") as folder:
        copy = Path(folder, "history.sqlite")
        shutil.copyfile(base.name, copy)
        run = append(copy, results, revision())
        with opened(copy) as connection:
            found = worse(read_series(connection, str(results.get("subject", "tracer"))), run)
    named = {entry["case"] for entry in found}
    cases = [case["name"] for case in results["cases"] if case["verdict"] not in GOOD and case["name"] not in named]
    return Standing(
        worse=[entry["sentence"] for entry in found],
        as_before=[f"{name}: fails, and is no worse than in {base.name}" for name in cases],
        cases=cases,
    )
