"""`rayproof run`: judge the tracer on cases or scene files, write a results folder and publish it."""

import errno
import os
from pathlib import Path

from reports.commands.lookup import Repeated, configurations, references_named
from reports.commands.usage import UsageError, told_in_one_line, writable_folder


def run(
    *selectors: str,
    out: Path = Path("report"),
    resume: bool = False,
    require: Repeated = (),
    jobs: int | None = None,
    timeout: float = 120.0,
    configuration: Repeated = (),
    formula: Repeated = (),
    json: Path | None = None,
) -> int:
    """Judge the tracer on cases or scene files and write a report.

    Parameters
    ----------
    selectors
        Families, family/case names, patterns such as `shadow/*`, or scene files ending in .json. Default: all cases.
    out
        Folder for results and report.
    resume
        Go on with the run that OUT holds; finished cases are not done again.
    require
        A reference that must have a say: a case about which it can say nothing at all fails; one that answers on
        request only is asked. Repeatable.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Seconds that one render or one judgement may take.
    configuration
        A tracer configuration, such as float32/triangle=signed_areas. Repeatable. Default: the suite's own list.
    formula
        A formula for every configuration, such as triangle=signed_areas. Repeatable.
    json
        Also write results.json to this file.

    """
    from reports.run.request import RunRequest

    if not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    references_named(require)
    with told_in_one_line():
        check_selectors(selectors)
        chosen = configurations(configuration, formula)
        writable_folder(out)
        if json is not None:
            writable_folder(json.parent)
            if json.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a folder, not a file to write", str(json))
    request = RunRequest(
        selectors=selectors,
        out=out,
        resume=resume,
        require=require,
        jobs=jobs or os.cpu_count() or 1,
        timeout=timeout,
        configurations=tuple(one.name for one in chosen),
        json=json,
    )
    from reports.run.suite import run as run_suite

    return run_suite(request)


def check_selectors(selectors: tuple[str, ...]) -> None:
    """Raise ValueError, LookupError or OSError for the first selector that names no case and no valid scene file."""
    from cases.families import select
    from cases.scene_json import load_scene

    for selector in selectors:
        if selector.endswith(".json"):
            load_scene(Path(selector))
        else:
            select([selector])
