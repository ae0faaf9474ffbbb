"""`rayproof audit`: plant faults one at a time, and say which the harness killed, where, and whom it blamed."""

import os
from pathlib import Path

from reports.commands.usage import UsageError, own, told_in_one_line, writable_folder


def audit(
    *,
    out: Path = Path("report"),
    only: str = "*",
    quick: bool = False,
    jobs: int | None = None,
    timeout: float = 120.0,
    json: Path | None = None,
) -> int:
    """Plant faults in the tracer, references, mesh loader and judge, one at a time, and print the kill matrix.

    Parameters
    ----------
    out
        Folder for audit.json; a report in it shows the score.
    only
        Faults to plant: a pattern such as `sphere/*`, or one of tracer, reference, loader, judge, run, report; or liar,
        the renderer that answers rightly only where the judge looks.
    quick
        Fewer cases a fault at first, and fewer grades.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Seconds that one case with all its faults may take.
    json
        Also write audit.json to this file.

    """
    from reports.audit.planted import planted
    from reports.audit.request import AuditRequest
    from reports.run.llvm import choose_packaged_llvm

    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    choose_packaged_llvm()
    with told_in_one_line():
        planted(only)
        own(out)
        if json is not None:
            writable_folder(json.parent)
    from reports.audit.suite import run

    return run(
        AuditRequest(out=out, only=only, quick=quick, jobs=jobs or os.cpu_count() or 1, timeout=timeout, json=json)
    )
