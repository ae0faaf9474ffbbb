"""`python -m tests.harness.audit`: plant faults one at a time; which are killed, where, and who is blamed."""

import os
import sys
from pathlib import Path

from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from tests.command_line import call


def audit(
    *,
    out: Path = Path("report"),
    only: str = "*",
    quick: bool = False,
    jobs: int | None = None,
    timeout: float = 120.0,
    json: Path | None = None,
    diagnose: bool = False,
    pairs: int = 0,
    cases: str = "",
    seed: int = 0,
) -> int:
    """Plant faults in the tracer and the references, one at a time, and print the kill matrix.

    Parameters
    ----------
    out
        Folder for audit.json.
    only
        Faults to plant: a pattern such as `sphere/*`, or one of tracer and reference; or liar, the renderer that
        answers rightly only where the judge looks; or a wrong formula of one's own, such as
        sphere=./mine.py:nearest_hit.
    quick
        Fewer cases a fault at first, and fewer grades.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Seconds that one case with all its faults may take.
    json
        Also write audit.json to this file.
    diagnose
        Measure instead how many mistakes are named rightly: build the C++ example that makes any of over a hundred
        mistakes on request, and diagnose each, or those that `--only` names (patterns, with commas). Needs a C++
        compiler and some 40 minutes of processor time.
    pairs
        With --diagnose: measure so many pairs of these mistakes instead, drawn at random; a minute each.
    cases
        With --diagnose: the cases that are rendered, by patterns with commas; all of the suite without.
    seed
        With --pairs: what is drawn.

    """
    if diagnose:
        return _diagnosed(
            jobs=jobs or os.cpu_count() or 1, quick=quick, only=only, json=json, cases=cases, pairs=pairs, seed=seed
        )
    if pairs or cases:
        raise UsageError("--pairs and --cases go with --diagnose")
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm
    from tests.harness.audit.planted import planted
    from tests.harness.audit.suite import AuditRequest

    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    choose_packaged_llvm()
    with told_in_one_line():
        planted(only)
        own(out)
        if json is not None:
            writable_folder(json.parent)
    from tests.harness.audit.suite import run

    return run(
        AuditRequest(out=out, only=only, quick=quick, jobs=jobs or os.cpu_count() or 1, timeout=timeout, json=json)
    )


def _diagnosed(*, jobs: int, quick: bool, only: str, json: Path | None, cases: str, pairs: int, seed: int) -> int:
    """Print how many mistakes are named rightly; return 1 if any is named wrongly."""
    from subprocess import CalledProcessError

    from rayproof.reports.commands.output import say, show_table, write_json
    from tests.harness.audit.diagnosing import measure

    if pairs < 0:
        raise UsageError(f"--pairs must not be negative, got {pairs}")
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    try:
        found = measure(jobs=jobs, quick=quick, only=only, cases=cases, pairs=pairs, seed=seed)
    except (FileNotFoundError, CalledProcessError, LookupError) as error:
        raise UsageError(f"--diagnose: {error}") from None
    write_json(json, found)
    columns = ["programs", "written", "of", "right", "class_of_at_most_2", "wrong", "does_not_know", "unseen"]
    rows = [[str(row[column]) for column in columns] for row in found["table"]]
    show_table("Mistakes named by their images", [column.replace("_", " ") for column in columns], rows)
    for one in found["wrong_names"]:
        say(f"named wrongly: {one['mistake'] or 'no mistake'} ({one['written']}) as {', '.join(one['named'])}")
    return 1 if found["wrong_names"] else 0


if __name__ == "__main__":
    sys.exit(call(audit))
