"""`python -m tests.harness.shrinking`: shrink failing cases of a sample of wrong renderers; write the table."""

import sys
from pathlib import Path

from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line
from tests.command_line import call


def shrinking(
    *, out: Path = Path("shrinking"), count: int = 60, seed: int = 38, tries: int = 200, only: str = "*"
) -> int:
    """Shrink a failing case of each of a sample of wrong renderers, and say how small the scenes become.

    Ends with 0 if the scenes are as small as docs/failures.md promises. What OUT holds already is not done again.

    Parameters
    ----------
    out
        Folder for shrunk.jsonl, with a line for each renderer, and table.md.
    count
        So many renderers, drawn from the tracer's planted faults and the switches of the C++ example, by all stages and
        by radiance alone. 0: all of them.
    seed
        Another seed draws others, and other cases.
    tries
        Renders that each may take.
    only
        Renderers to draw from: a pattern of their names, such as `sphere/*`.

    """
    if count < 0 or tries < 1:
        raise UsageError(f"--count must not be negative and --tries at least 1, got {count} and {tries}")
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm
    from tests.harness.audit.diagnosing import compiler
    from tests.harness.shrinking.campaign import Campaign, run

    if compiler() is None:
        raise UsageError("no C++ compiler (c++, g++ or clang++) is on the PATH")

    choose_packaged_llvm()
    with told_in_one_line():
        own(out)
    found = run(Campaign(out=out, count=count, seed=seed, tries=tries, only=only))
    for line in found.table():
        say(line)
    for line in found.problems():
        say(f"PROBLEM: {line}")
    return 1 if found.problems() else 0


if __name__ == "__main__":
    sys.exit(call(shrinking))
