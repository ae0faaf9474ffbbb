"""`rayproof run --merge`: several machines' parts of a run become one run."""

from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder

if TYPE_CHECKING:
    from rayproof.reports.history.gating import Demanded


def merge(
    folders: tuple[Path, ...],
    *,
    out: Path,
    demanded: "Demanded | None",
    history: Path | None,
    json: Path | None,
) -> int:
    """Put the parts of a run together that `rayproof run --shard` made, and publish them as one run.

    They must be of the same code, plan, subject and demands. The cases of a part that is not there are missing, and the
    run counts as not finished. `out` is none of the parts' folders.
    """
    if not folders:
        raise UsageError("name the folders of the parts: rayproof run --merge DIR... --out ALL")
    from rayproof.reports.results.headline import THE_USUAL
    from rayproof.reports.results.provenance import keep_whole
    from rayproof.reports.run import suite
    from rayproof.reports.run.options import RunOptions, images_to_keep
    from rayproof.reports.run.shards import load_shards, merge
    from rayproof.reports.terminal import console as terminal

    with told_in_one_line():
        if out.resolve() in {folder.resolve() for folder in folders}:
            raise ValueError(f"--out {out} is the folder of one of the parts; name another folder")
        shards = load_shards(folders)
        for file in filter(None, (history, json)):
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
        history=history,
        demanded=demanded,
        diagnose=about["diagnose"],
        images=images_to_keep(about.get("keep_images"), cases=about["planned"]),
    )
    if (sentence := suite.replaced(out)) is not None:
        say(sentence)
    suite.clear(out)
    with told_in_one_line():
        results, found = merge(shards, out, tracer=tracer)
        keep_whole(folders[0], out)
    there = {shard.about["number"] for shard in shards}
    for number in sorted({*range(1, about["of"] + 1)} - there):
        say(f"part {number}/{about['of']} was not given: its cases are missing")
    console = terminal(width=suite.LOG_WIDTH)
    suite.find_out(request, results, console, tracer=tracer, whole=True)
    pictures = str(results["environment"]["pictures"])
    suite.conclude(request, results, None if pictures == "drawn" else pictures, console)
    return suite.code_of(request, results, found, console, tracer=tracer)
