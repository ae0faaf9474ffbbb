"""Parts of a case's record: the scene, the command to reproduce it, settings; the record after a failed judgement.

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
    """Return the command that runs only this case, with the same subject and configurations.

    Configurations are left out if they are the suite's own. A user's scene is named by its file.
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


# Prefix of the kinds of cases that a program can declare not to draw; see `reports.subjects.protocol`.
DECLARABLE = "declarable: "


def kinds_of(scene: Scene, truth: StageImages) -> list[str]:
    """Return the kinds of a case, in words; kinds that a program can declare not to draw have a prefix."""
    kinds = [f"{DECLARABLE}with a {NAMES[kind]}" for kind in dict.fromkeys(map(type, scene.shapes))]
    kinds += [f"{DECLARABLE}with a two-sided surface"] if any(shape.two_sided for shape in scene.shapes) else []
    if not all(is_similarity(shape.to_world) for shape in scene.shapes):
        kinds.append(f"{DECLARABLE}with a stretched or sheared shape")
    kinds += [f"{DECLARABLE}with {scene.shading} light", f"{DECLARABLE}clipped by {scene.clip}"]
    if len(scene.lights) > 1:
        kinds.append("with several lights")
    if {Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY} <= {*truth}:
        for number, light in enumerate(scene.lights):
            towards = np.asarray(light.position) - truth[Stage.POSITION]
            faces = np.einsum("...c,...c", towards, truth[Stage.NORMAL]) > 0
            if (faces & (truth[Stage.VISIBILITY][..., number] == 0)).any():
                return ["with a blocked light", *kinds]
    return kinds


def unjudged(
    case: Case,
    subjects: Sequence[Answers],
    references: Sequence[Answers],
    reply: Reply,
    *,
    folder: Path,
    subject: Subject,
) -> CaseRecord:
    """Return the record that docs/results.md describes; `reply` is the judge's, with its error."""
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
    renders = [(subject.renderer(renderer.name), renderer.name, renderer.error, False) for renderer in subjects]
    renders += [(renderer.name, None, renderer.error, renderer.cached) for renderer in references]
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
        "abstained": {renderer.name: renderer.error for renderer in references if renderer.error is not None},
        "stopped": [renderer.name for renderer in (*subjects, *references) if renderer.stopped]
        + ["the judge"] * reply.stopped,
        "notes": [],
        "checks": checks,
        "expectations": [],
        "adjudication": {},
        "pixels": None,
        "masks": None,
    }


def said(reference: Answers) -> dict[str, str]:
    """Return a reference's settings and tolerances, name to value with unit, without zero tolerances."""
    settings = dict(reference.settings)
    if reference.ray_epsilon:
        settings["ray epsilon"] = f"{reference.ray_epsilon:.3g} m"
    if reference.light_epsilon:
        settings["light epsilon"] = f"{reference.light_epsilon:.3g} of a shadow ray's length"
    if reference.edge_epsilon:
        settings["edge epsilon"] = f"{reference.edge_epsilon:.3g} m"
    if reference.tie_epsilon:
        settings["tie epsilon"] = f"{reference.tie_epsilon:.3g} m"
    shadow = np.asarray(reference.shadow_epsilon, dtype=np.float64)
    finite = shadow[np.isfinite(shadow)]
    if finite.size and finite.max() > 0:
        low, high = float(finite.min()), float(finite.max())
        settings["shadow epsilon"] = f"{high:.3g} m" if low == high else f"{low:.3g} to {high:.3g} m"
    for stage, resolution in reference.resolutions.items():
        settings[f"resolution of {stage}"] = resolution.because
    return settings
