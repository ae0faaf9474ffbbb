"""How a case is run again: its scene, written into the results folder, and the command that asks about it alone."""

import json
import shlex
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.scene_json import PACKED, scene_to_json
from rayproof.reports.called import called
from rayproof.reports.run.plan import DEFAULTS
from rayproof.reports.run.scene_case import FAMILY, place_of
from rayproof.reports.subjects import THE_TRACER, Subject


def write_scene(folder: Path, case: Case) -> str:
    """Write the scene as JSON, meshes inline, large ones packed; return its path relative to the results `folder`."""
    path = Path("scenes", f"{place_of(case.name)}.json")
    (folder / path).parent.mkdir(parents=True, exist_ok=True)
    (folder / path).write_text(
        json.dumps(scene_to_json(case.scene, packed=PACKED), separators=(",", ":")), encoding="utf-8"
    )
    return path.as_posix()


def reproduce(folder: Path, case: Case, configurations: tuple[str, ...], subject: Subject = THE_TRACER) -> str:
    """Return the command that runs the case alone, by the same subject and configurations if not the suite's own.

    A user's scene has no name that would find it, only a file.
    """
    if not subject.is_tracer:
        chosen = f" --subject {shlex.quote(subject.title)}"
    elif configurations[: len(DEFAULTS)] == DEFAULTS:
        chosen = ""
    else:
        chosen = "".join(f" --configuration {shlex.quote(name)}" for name in configurations)
    if case.family != FAMILY:
        return f"{called()} run {case.name}{chosen}"
    return f"{called()} run {shlex.quote(str(folder / 'scenes' / f'{place_of(case.name)}.json'))}{chosen}"
