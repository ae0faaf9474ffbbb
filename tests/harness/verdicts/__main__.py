"""`python -m tests.harness.verdicts`: judge random scenes, and hold each verdict against certified arithmetic."""

import os
import sys
from pathlib import Path

from rayproof.cases.random_scenes import LARGEST
from rayproof.reports.commands.output import write_json
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.processes.scratch import scratch
from rayproof.reports.subjects import THE_TRACER, TRACER
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.command_line import call


def verdicts(
    *,
    count: int = 100,
    seed: int = 1,
    subject: str = TRACER,
    resume: bool = False,
    out: Path = Path("verdicts"),
    jobs: int | None = None,
    timeout: float = 900.0,
    json: Path | None = None,
) -> int:
    """Judge scenes drawn at random, with hostile features, and ask of each verdict whether it is right.

    Ends with 0 if no verdict is wrong, and at most 1 % of the scenes are left undecided that need not be.

    Parameters
    ----------
    count
        So many scenes, numbers 0 and up.
    seed
        Another seed draws other scenes.
    subject
        The renderer that is judged: tracer, a reference's name, or exec:COMMAND with {scene} and {output}.
    resume
        Go on with what OUT holds of the same seed and subject.
    out
        Folder for verdicts.json, and for scenes.jsonl with a line for each scene.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Seconds that all of one scene may take.
    json
        Also write verdicts.json to this file.

    """
    if not 1 <= count <= LARGEST:
        raise UsageError(f"--count must be from 1 to {LARGEST} scenes, got {count}")
    if not 0 <= seed <= LARGEST:
        raise UsageError(f"--seed must be from 0 to {LARGEST}, got {seed}")
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    choose_packaged_llvm()
    from tests.harness.verdicts.campaign import Campaign, run
    from tests.harness.verdicts.trials import subject_named

    with scratch():
        with told_in_one_line():
            tested = THE_TRACER if subject == TRACER else subject_named(subject)
            own(out)
            if json is not None:
                writable_folder(json.parent)
        workers = jobs or os.cpu_count() or 1
        asked = Campaign(count=count, seed=seed, subject=tested, resume=resume, out=out, jobs=workers, timeout=timeout)
        tally = run(asked)
    write_json(json, tally.as_json())
    return 0 if tally.sound else 1


if __name__ == "__main__":
    sys.exit(call(verdicts))
