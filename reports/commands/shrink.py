"""`rayproof shrink`: reduce a failing case to the smallest scene with the same failure, and write an issue."""

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.lookup import TRACER, Repeated, configurations, scene_named, subject_named
from rayproof.reports.commands.output import say, shout
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.program_name import called

if TYPE_CHECKING:
    from rayproof.cases.stages import Stage
    from rayproof.reports.shrinking.attempts import Search

USUAL = 200  # renders
CLEARED = 100  # columns to overwrite, since the previous line may have been longer
UNCONFIRMED, INTERRUPTED = 1, 130


def shrink(
    case: str,
    *,
    out: Path,
    subject: str = TRACER,
    declare: Path | None = None,
    configuration: str = "float32",
    formula: Repeated = (),
    stage: str | None = None,
    tries: int = USUAL,
    seconds: float | None = None,
) -> int:
    """Reduce a failing case to the smallest scene with the same failure, and write it with an issue to paste.

    For example: rayproof shrink primitives/sphere --formula sphere/textbook --out small

    A scene has the same failure if the same stage is wrong in the same way (no number, a wrong hit, a wrong value) and
    breaks the same item of the specification. The oracle judges each attempt. All references judge the result; the exit
    code is 1 if they do not find the renderer wrong.

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    out
        Folder for scene.json, pixel.json, pixel.md, picture.png, issue.md and, if one shape is hit wrongly,
        vector.csv.
    subject
        The renderer that fails, if not the tracer: a reference by name, "exec:COMMAND {scene} {output}",
        "serve:COMMAND" or "python:FILE.py:FUNCTION".
    declare
        A JSON file with properties of a program that it does not declare itself, as in `rayproof run`.
    configuration
        The tracer's configuration, such as float64/triangle=woop.
    formula
        A formula for it, such as triangle=signed_areas, or a function of your own as
        sphere=./mine.py:nearest_hit. Repeatable.
    stage
        The stage whose failure is kept, such as distance. Default: the first stage that fails.
    tries
        The maximum number of renders. The same number gives the same scene, however busy the machine is.
    seconds
        The maximum time [s] of the search. Ctrl-C also ends the search; the smallest scene so far is kept.

    """
    if tries < 1:
        raise UsageError(f"--tries must be at least 1, got {tries}")
    if seconds is not None and not seconds > 0:
        raise UsageError(f"--seconds must be positive, got {seconds}")
    if (formula or configuration != "float32") and subject != TRACER:
        raise UsageError("--configuration and --formula are the tracer's, and --subject names another renderer")
    scene = scene_named(case)
    at = _stage(stage)
    (chosen,) = configurations([configuration], formula)
    with told_in_one_line():
        writable_folder(out)
        own(out)
    tested = subject_named(subject, declare=declare)
    shout(chosen.faults)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.shrinking.attempts import SearchLimits
    from rayproof.reports.shrinking.failure import renderer
    from rayproof.reports.shrinking.issue import Report, in_words, judged_by_all
    from rayproof.reports.shrinking.search import NothingFailsError
    from rayproof.reports.shrinking.search import shrink as search_smallest

    scene, render = tested.capabilities.asked(scene), renderer(tested, chosen)
    try:
        smallest = search_smallest(
            scene, render, stage=at, limits=SearchLimits(tries=tries, seconds=seconds), progress=_Progress(out)
        )
    except NothingFailsError as nothing:
        raise UsageError(f"{case}: {nothing}") from None
    say(f"{case}: {in_words(scene)}; after {smallest.tries} renders: {in_words(smallest.scene)}")
    words = [f"--configuration={configuration}", *(f"--formula={name}" for name in formula)]
    words = words if tested.is_tracer else ["--subject", subject]
    words += ["--declare", str(declare)] if declare is not None else []
    report = Report(
        scene=smallest.scene,
        failure=smallest.failure,
        renderer=f"tracer {chosen.name}" if tested.is_tracer else subject,
        command=f"{called()} {shlex.join(['run', 'scene.json', *words])}",
    )
    report.write(out, render)
    if smallest.interrupted:
        say(f"interrupted: {out} has the smallest scene so far, which all references together have not judged")
        return INTERRUPTED
    confirmed, sentence = judged_by_all(out / "scene.json", tested, chosen.name)
    replace(report, panel=sentence).write_issue(out)
    for line in (out / "issue.md").read_text(encoding="utf-8").splitlines():
        say(line)
    files = "scene.json", "pixel.json", "pixel.md", "vector.csv", "picture.png", "issue.md"
    say(f"written to {out}: {', '.join(name for name in files if (out / name).is_file())}")
    return 0 if confirmed else UNCONFIRMED


def _stage(name: str | None) -> "Stage | None":
    from rayproof.cases.stages import Stage

    if name is None:
        return None
    if name not in set(Stage):
        raise UsageError(f"--stage: no stage is called {name!r}; known: {', '.join(Stage)}")
    return Stage(name)


class _Progress:
    """Prints the progress of the search, and saves the smallest scene so far in case the search is interrupted."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._kept = folder, None

    def __call__(self, search: "Search") -> None:
        from rayproof.reports.shrinking.issue import in_words
        from rayproof.reports.subjects.protocol import hand_over

        if search.scene is not self._kept:
            self._kept = search.scene
            hand_over(search.scene, self._folder)
        if sys.stderr.isatty():
            line = f"render {search.tries} of {search.limits.tries}: {in_words(search.scene)}"
            sys.stderr.write(f"\r{line:<{CLEARED}}")
            sys.stderr.flush()
