"""`rayproof merge`: merge the parts of a run that several machines made."""

from pathlib import Path
from typing import Annotated

from rayproof.reports.commands.output import say
from rayproof.reports.commands.run import FLAT, NO_GATE, OUTPUT, GateOptions
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder


def merge(
    *folders: Path,
    out: Annotated[Path, OUTPUT] = Path("report"),
    json: Annotated[Path | None, OUTPUT] = None,
    gate: Annotated[GateOptions, FLAT] = NO_GATE,
) -> int:
    """Merge the parts of a run that `rayproof run --shard` made, and publish them as a single run.

    All parts must have the same code, plan, subject and options. If a part is absent, its cases are reported as missing
    and the run as not finished.

    For example: rayproof merge part1 part2 part3 --out whole

    Parameters
    ----------
    folders
        The folders of the parts; OUT must be another folder.
    out
        Folder for results and report.
    json
        Also write results.json to this file.

    """
    if not folders:
        raise UsageError("name the folders of the parts: rayproof merge DIR... --out ALL")
    from rayproof.reports.results.headline import THE_USUAL
    from rayproof.reports.results.provenance import keep_whole
    from rayproof.reports.run import shards as parts
    from rayproof.reports.run import suite
    from rayproof.reports.run.options import RunOptions, images_to_keep
    from rayproof.reports.terminal import console as terminal

    with told_in_one_line():
        if out.resolve() in {folder.resolve() for folder in folders}:
            raise ValueError(f"--out {out} is the folder of one of the parts; name another folder")
        demanded = gate.demanded()
        shards = parts.load_shards(folders)
        for file in filter(None, (gate.history, json)):
            writable_folder(file.parent)
        own(out)
    about, subject = shards[0].about, str(shards[0].document.get("subject", THE_USUAL))
    tracer = subject == THE_USUAL
    request = RunOptions(
        selectors=(),
        out=out,
        resume=False,
        require=tuple(about["require"]),
        jobs=1,
        timeout=0.0,
        configurations=(),
        json=json,
        history=gate.history,
        demanded=demanded,
        least_coverage=gate.least_coverage,
        diagnose=about["diagnose"],
        images=images_to_keep(about.get("keep_images"), cases=about["planned"]),
    )
    if (sentence := suite.replaced(out)) is not None:
        say(sentence)
    suite.clear(out)
    with told_in_one_line():
        results, totals = parts.merge(shards, out, tracer=tracer)
        keep_whole(folders[0], out)
    there = {shard.about["number"] for shard in shards}
    for number in sorted({*range(1, about["of"] + 1)} - there):
        say(f"part {number}/{about['of']} was not given: its cases are missing")
    console = terminal(width=suite.LOG_WIDTH)
    suite.find_out(request, results, console, tracer=tracer, whole=True)
    pictures = str(results["environment"]["pictures"])
    suite.conclude(request, results, None if pictures == "drawn" else pictures, console)
    code = suite.code_of(request, results, totals, console, tracer=tracer)
    from rayproof.reports.commands.report import write_one_file

    write_one_file(out, asked=False)
    return code
