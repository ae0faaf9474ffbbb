"""`rayproof call`: one call of a program under test, made again in a folder, with all that it was handed and said."""

from pathlib import Path

from rayproof.reports.commands.lookup import Repeated, scene_named
from rayproof.reports.commands.output import say
from rayproof.reports.commands.run import USUAL_LIMIT, subject_named
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

FAILED = 1


def call(
    case: str,
    *,
    subject: str,
    out: Path = Path("call"),
    timeout: float = USUAL_LIMIT,
    env: Repeated = (),
    confine: bool = False,
) -> int:
    """Call a program under test once, and keep what it was handed, its command, and what it said and wrote.

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    subject
        The program: "exec:COMMAND {scene} {output}".
    out
        Folder for scene.json, meshes, the image, and call.txt with the command, exit code and standard error.
    timeout
        Seconds that the call may take.
    env
        A variable of the environment that the program gets beside the usual ones. Repeatable.
    confine
        Shut the program off, as `rayproof run --confine` does.

    """
    if not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    scene = scene_named(case)
    tested = subject_named(subject, env, confine=confine, seconds=timeout)
    from rayproof.reports.run.asking_subject import answered
    from rayproof.reports.subjects import PROGRAM
    from rayproof.reports.subjects.keeping import TOLD, Keep

    if tested.name != PROGRAM:
        raise UsageError(f"--subject: a call is a program's, exec:COMMAND; got {subject!r}")
    scene = tested.capabilities.under_its_light(scene)
    with told_in_one_line():
        writable_folder(out)
        found = answered(tested, scene, keep=Keep(folder=out, image=True))
    if (refusal := tested.capabilities.refusal(scene)) is not None:
        say(f"{case}: not handed over, beyond what it declares: {refusal}")
        return 0
    for line in (out / TOLD).read_text(encoding="utf-8").splitlines():
        say(line)
    say("")
    if found.error is not None:
        say(f"{case}: {found.error}")
    else:
        say(f"{case}: stages {', '.join(found.answers or {}) or 'none'}")
    say(f"what it was handed, said and wrote is in {out}, this as {TOLD}")
    return 0 if found.error is None else FAILED
