"""Parts of a case's record: its scene, the command to reproduce it, what renderers said; a case whose judge died.

`unjudged` is the record of a case whose judge died or raised: every planned check of it is an error.
"""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene, is_similarity
from rayproof.cases.scene_json import NAMES, PACKED, scene_to_json
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.measurement import unexamined
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.processes.worker import Reply
from rayproof.reports.program_name import called
from rayproof.reports.results.case_records import CaseRecord, Check
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.plan import DEFAULTS, PlannedCase
from rayproof.reports.run.pooled_factors import camera_and_lights
from rayproof.reports.run.scenes import FAMILY, place_of
from rayproof.reports.subjects import THE_TRACER, Subject


def write_scene(folder: Path, case: Case) -> str:
    """Write the scene as JSON, meshes inline, large ones packed; return its path relative to the results `folder`."""
    path = Path("scenes", f"{place_of(case.name)}.json")
    (folder / path).parent.mkdir(parents=True, exist_ok=True)
    (folder / path).write_text(
        json.dumps(scene_to_json(case.scene, packed=PACKED), separators=(",", ":")), encoding="utf-8"
    )
    return path.as_posix()


def reproduce(folder: Path, planned: PlannedCase, subject: Subject = THE_TRACER) -> str:
    """Return the command that runs the case alone, by the same subject and configurations if not the suite's own.

    A user's scene has no name that would find it, only a file.
    """
    case, configurations = planned.case, planned.configurations
    if not subject.is_tracer:
        chosen = f" {shlex.join(subject.options)}"
    elif configurations[: len(DEFAULTS)] == DEFAULTS:
        chosen = ""
    else:
        chosen = "".join(f" --configuration {shlex.quote(name)}" for name in configurations)
    if case.family != FAMILY:
        return f"{called()} run {case.name}{chosen}"
    return f"{called()} run {shlex.quote(str(folder / 'scenes' / f'{place_of(case.name)}.json'))}{chosen}"


# What of a scene a program can declare that it does not draw; see `reports.subjects.protocol`.
DECLARABLE = "declarable: "


def kinds_of(scene: Scene, truth: StageImages) -> list[str]:
    """Return what kind of case a scene makes, in words; those that a program can declare not to draw are marked."""
    found = [f"{DECLARABLE}with a {NAMES[kind]}" for kind in dict.fromkeys(map(type, scene.shapes))]
    found += [f"{DECLARABLE}with a two-sided surface"] if any(shape.two_sided for shape in scene.shapes) else []
    if not all(is_similarity(shape.to_world) for shape in scene.shapes):
        found.append(f"{DECLARABLE}with a stretched or sheared shape")
    found += [f"{DECLARABLE}with {scene.shading} light", f"{DECLARABLE}clipped by {scene.clip}"]
    if len(scene.lights) > 1:
        found.append("with several lights")
    if {Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY} <= {*truth}:
        for number, light in enumerate(scene.lights):
            towards = np.asarray(light.position) - truth[Stage.POSITION]
            faces = np.einsum("...c,...c", towards, truth[Stage.NORMAL]) > 0
            if (faces & (truth[Stage.VISIBILITY][..., number] == 0)).any():
                return ["with a blocked light", *found]
    return found


def unjudged(
    case: Case,
    subjects: Sequence[Answers],
    references: Sequence[Answers],
    reply: Reply,
    *,
    folder: Path,
    subject: Subject,
) -> CaseRecord:
    """Return the record, as docs/results.md describes it; `reply` is what came of judging."""
    why = f"judging failed: {reply.error}"
    checks = [
        Check(
            configuration=configuration.name,
            reference=reference.name,
            stage=stage,
            outcome=Outcome.ERROR,
            reason=why,
            ratio=0.0,
            examined=unexamined(stage, case.scene.camera),
            because="",
        )
        for configuration in subjects
        for reference in references
        for stage in stages_of(case.scene)
        if reference.answers_at(stage)
    ]
    renders = [(subject.renderer(one.name), one.name, one.error, False) for one in subjects]
    renders += [(one.name, None, one.error, one.cached) for one in references]
    return {
        "name": case.name,
        "family": case.family,
        "verdict": Outcome.ERROR.value,
        "stage": None,
        "item": None,
        "reason": why,
        "trace": reply.trace,
        "stresses": case.stresses,
        "covers": list(case.covers),
        "planned": len(checks),
        "scene": write_scene(folder, case),
        "picture": None,
        "width": case.scene.camera.width,
        "height": case.scene.camera.height,
        "lights": len(case.scene.lights),
        "camera_and_lights": camera_and_lights(case.scene),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "settings": {},
        "renders": [
            {"renderer": name, "configuration": configuration, "image": None, "error": error, "cached": cached}
            for name, configuration, error, cached in renders
        ],
        "ran": {},
        "unsupported": [],
        "abstained": {one.name: one.error for one in references if one.error is not None},
        "stopped": [one.name for one in (*subjects, *references) if one.stopped] + ["the judge"] * reply.stopped,
        "notes": [],
        "checks": checks,
        "expectations": [],
        "adjudication": {},
        "pixels": None,
        "masks": None,
    }


def said(reference: Answers) -> dict[str, str]:
    """Return name to value with its unit; only what is set or not zero."""
    told = dict(reference.settings)
    if reference.ray_epsilon:
        told["ray epsilon"] = f"{reference.ray_epsilon:.3g} m"
    if reference.light_epsilon:
        told["light epsilon"] = f"{reference.light_epsilon:.3g} of a shadow ray's length"
    if reference.edge_epsilon:
        told["edge epsilon"] = f"{reference.edge_epsilon:.3g} m"
    if reference.tie_epsilon:
        told["tie epsilon"] = f"{reference.tie_epsilon:.3g} m"
    shadow = np.asarray(reference.shadow_epsilon, dtype=np.float64)
    known = shadow[np.isfinite(shadow)]
    if known.size and known.max() > 0:
        low, high = float(known.min()), float(known.max())
        told["shadow epsilon"] = f"{high:.3g} m" if low == high else f"{low:.3g} to {high:.3g} m"
    for stage, resolution in reference.resolutions.items():
        told[f"resolution of {stage}"] = resolution.because
    return told
