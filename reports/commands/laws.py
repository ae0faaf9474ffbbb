"""`rayproof laws`: a renderer against itself, by relations between its images of a scene and of changed scenes."""

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rayproof.reports.commands.lookup import Repeated, configurations
from rayproof.reports.commands.output import say, shout, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

if TYPE_CHECKING:
    from rayproof.reports.laws.suite import LawsRecord

CLEARED = 100  # columns of an earlier, longer line
USUAL = ("float32", "float64")
TRACER = "tracer"
SHOWN = 12  # alarms that are printed one by one


def laws(
    *selectors: str,
    subject: str = TRACER,
    configuration: Repeated = (),
    formula: Repeated = (),
    all: bool = False,
    image: bool = False,
    out: Path | None = None,
    jobs: int | None = None,
    timeout: float = 120.0,
    memory: float = 8.0,
    env: Repeated = (),
    confine: bool = False,
    json: Path | None = None,
) -> int:
    """Test a renderer against itself: a law relates its images of a scene to those of a changed scene.

    No reference is asked. docs/laws.md derives how far rounding may break a law.

    Parameters
    ----------
    selectors
        Laws, families, family/case names, or patterns. Default: a choice of laws and cases.
    subject
        The renderer under test instead of the tracer: a reference by name, or "exec:COMMAND {scene} {output}".
    configuration
        A tracer configuration, such as float64/triangle=signed_areas. Repeatable. Default: float32 and float64.
    formula
        A formula for every configuration, such as triangle=signed_areas. Repeatable.
    all
        Ask every law about every named case, or about all cases.
    image
        Look at radiance alone.
    out
        Folder for laws.json, the report and JUnit.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Time limit [s] of one law on one case, or of one call of a program.
    memory
        Limit [GiB] of the address space of a program under test.
    env
        An environment variable to pass to a program under test. Repeatable.
    confine
        Isolate a program under test, as `rayproof run --confine` does.
    json
        Also write the results to this file.

    """
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    if not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    if subject != TRACER and (configuration or formula):
        raise UsageError("--configuration and --formula apply to the tracer only and exclude --subject")
    with told_in_one_line():
        for folder in (out, json.parent if json is not None else None):
            if folder is not None:
                writable_folder(folder)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.cases.stages import Stage
    from rayproof.reports.commands.run import under_test
    from rayproof.reports.laws.suite import LawsRequest, chosen, document, exit_code, run
    from rayproof.reports.subjects import Surroundings

    with told_in_one_line():
        pairs = chosen(selectors, everything=all)
        wanted = configurations(configuration, formula)
        surroundings = Surroundings(variables=env, confined=confine)
        # No reference is asked here, so that the oracle may be under test as well.
        tested = under_test(subject, seconds=timeout, memory=memory, surroundings=surroundings, before_oracle=False)
    shout(sorted({fault for one in wanted for fault in one.faults}))
    names = tuple(one.name for one in wanted) or USUAL
    # A program is called for every scene of a law, and each call has its own limit.
    calls = 20 if tested.command else 1
    request = LawsRequest(
        subject=tested,
        configurations=names if tested.is_tracer else (tested.name,),
        pairs=pairs,
        stages=(Stage.RADIANCE,) if image else tuple(Stage),
        jobs=jobs or os.cpu_count() or 1,
        timeout=timeout * calls,
        keep=out is not None,
    )
    start, total = time.perf_counter(), len(pairs) * len(request.configurations)
    progress = Progress(total)
    finished = False
    try:
        run(request, progress.tell)
        finished = True
    except KeyboardInterrupt:
        sys.stderr.write("\n")
    reports = progress.reports
    content = document(request, reports, time.perf_counter() - start, finished=finished)
    if out is not None:
        from rayproof.reports.laws.suite import publish

        publish(out, content, reports, request)
    write_json(json, content)
    show(content)
    if not finished:
        raise KeyboardInterrupt  # nothing is lost; the command line says what happened
    return exit_code(content)


class Progress:
    """Say on standard error how far it has come; piped, only what is broken."""

    def __init__(self, total: int) -> None:
        self._total, self._done = total, 0
        self.reports: list[Any] = []

    def tell(self, report: Any, seconds: float) -> None:
        """Say that one law on one case is done."""
        self._done += 1
        self.reports.append(report)
        line = f"[{self._done}/{self._total}] {report.law} on {report.case} {report.configuration} ({seconds:.1f} s)"
        if report.error is not None:
            sys.stderr.write(f"\r{line}: error: {report.error}\n")
        elif report.alarms:
            sys.stderr.write(f"\r{line}: BROKEN at {report.alarms[0].stage}\n")
        elif sys.stderr.isatty():
            sys.stderr.write(f"\r{line:<{CLEARED}}" + ("\n" if self._done == self._total else ""))
        sys.stderr.flush()


def show(content: "LawsRecord") -> None:
    """Print a row for each law, then what is broken."""
    columns = ["law", "stage", "relations", "worst / K u", "excused", "verdict"]
    rows = [
        [
            row["law"] + (" (anchor)" if row["anchor"] else ""),
            row["stage"],
            row["relations"],
            f"{row['worst_over_Ku']:.3g}",
            row["excused"],
            row["verdict"],
        ]
        for row in content["laws"]
    ]
    show_table(f"{len(rows)} laws, {content['subject']}", columns, rows)
    alarms = [(row, one) for row in content["laws"] for one in row["alarms"]]
    for row, one in alarms[:SHOWN]:
        where = f" at pixel ({one['pixel'][0]}, {one['pixel'][1]})" if one["pixel"] else ""
        say(
            f"BROKEN: {row['law']}, {one['case']}, {one['configuration']}, {one['stage']}{where}: {one['what']}; "
            f"expected {numbers(one['expected'])}, measured {numbers(one['measured'])}; "
            f"implicates {', '.join(row['implicates'])}"
        )
    if len(alarms) > SHOWN:
        say(f"and {len(alarms) - SHOWN} more broken relations; --json or --out holds all")
    for row in content["laws"]:
        for problem in row["problems"][:1]:
            say(f"ERROR: {row['law']}, {problem}")
    say(
        f"{content['relations']} relations of {content['scenes']} images, {content['alarms']} alarms, "
        f"{content['errors']} errors, {content['seconds']:g} s"
    )


def numbers(values: list[float]) -> str:
    """Return numbers as a reader compares them."""
    return "(" + ", ".join(f"{value:.9g}" for value in values) + ")"
