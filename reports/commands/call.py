"""`rayproof call`: one call of a program under test, whose files are kept in a folder."""

from pathlib import Path

from rayproof.reports.commands.lookup import USUAL_LIMIT, Repeated, scene_named, subject_named
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

FAILED = 1


def call(
    case: str,
    folder: Path,
    *,
    subject: str,
    timeout: float = USUAL_LIMIT,
    env: Repeated = (),
    declare: Path | None = None,
) -> int:
    """Call a program under test once, and keep its scene, command, output and image.

    For example: rayproof call primitives/sphere kept --subject "exec:./mine {scene} {output}"

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    folder
        The folder for scene.json, the meshes, the image, and call.txt with the command, exit code and standard error.
    subject
        The program: "exec:COMMAND {scene} {output}", "serve:COMMAND" or "python:FILE.py:FUNCTION".
    timeout
        Time limit [s] of the call.
    env
        An environment variable to pass to the program, as in `rayproof run`. Repeatable.
    declare
        A JSON file with properties of the program that it does not declare itself, as in `rayproof run`.

    """
    if not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    scene = scene_named(case)
    tested = subject_named(subject, env, declare, seconds=timeout)
    from rayproof.reports.run.workers import answered
    from rayproof.reports.subjects.calls import TOLD
    from rayproof.reports.subjects.choosing import KNOWN

    if not tested.is_program:
        raise UsageError(f"--subject: a call is a program's, {KNOWN}; got {subject!r}")
    scene = tested.capabilities.asked(scene)
    with told_in_one_line():
        writable_folder(folder)
        answered_call = answered(tested, scene, keep=folder)
    if (refusal := tested.capabilities.refusal(scene)) is not None:
        say(f"{case}: not handed over, beyond what it declares: {refusal}")
        return 0
    for line in (folder / TOLD).read_text(encoding="utf-8").splitlines():
        say(line)
    say("")
    if answered_call.error is not None:
        say(f"{case}: {answered_call.error}")
    else:
        say(f"{case}: stages {', '.join(answered_call.answers or {}) or 'none'}")
    say(f"what it was handed, said and wrote is in {folder}, this as {TOLD}")
    return 0 if answered_call.error is None else FAILED
