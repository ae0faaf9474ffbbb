"""What a run keeps of a case to look at: its images, and which of its pixels are near an edge."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from rayproof.cases.stages import IMAGE_STAGES, StageImages
from rayproof.reports.judge.answers import well_shaped
from rayproof.reports.judge.edge_classes import mask
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.scene_truth import Ground, Terms
from rayproof.reports.results.exr import write_answers
from rayproof.reports.results.float_codec import pack
from rayproof.reports.results.image_script import write_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import MasksRecord
from rayproof.reports.run.messages import JudgeTask
from rayproof.reports.run.scene_case import place_of
from rayproof.reports.subjects import TRACER, Subject


def keep_images(task: JudgeTask, outcome: Outcome) -> tuple[dict[str, str], str | None]:
    """Write renderers' stages; return renderer -> EXR file, and the one file of all where there are no EXR files.

    Of a case that passed the first configuration and the oracle are enough to look at, in one file; the independent
    references where the oracle has no answer. Of a case that the run does not keep, none. Of any other every renderer
    may be the one to look at, and where it did not merely warn with whatever reads EXR.
    """
    if not task.images.keeps(task.case.name, outcome):
        return {}, None
    everyone = task.images.full or outcome is not Outcome.PASS
    scene, candidates = task.case.scene, task.candidates if everyone else task.candidates[:1]
    oracle = any(witness.name == ORACLE and witness.answers for witness in task.witnesses)
    witnesses = [
        witness for witness in task.witnesses if everyone or (witness.name == ORACLE if oracle else witness.independent)
    ]
    parties = [(task.subject.renderer(one.name), well_shaped(scene, one).answers) for one in candidates]
    parties += [(one.name, well_shaped(scene, one).answers) for one in witnesses]
    renders = {
        name: images
        for name, answers in parties
        if (images := {stage: image for stage, image in (answers or {}).items() if stage in IMAGE_STAGES})
    }
    if task.images.full or outcome not in (Outcome.PASS, Outcome.WARN):
        return _write_files(task, renders), None
    if not renders:
        return {}, None
    path = Path("images", f"{place_of(task.case.name)}.js")
    known = {"camera": asdict(scene.camera), "lights": [*map(asdict, scene.lights)], "shading": scene.shading}
    write_pixels(task.folder / path, path.as_posix(), renders, known)
    return {}, path.as_posix()


def masks(task: JudgeTask, base: Ground | None) -> MasksRecord | None:
    """Return which pixels may differ, for the first configuration before the oracle, as plain JSON data.

    `base` is what the case was judged on; None where the oracle had no answer.
    """
    truth = next((witness for witness in task.witnesses if witness.name == ORACLE), None)
    candidate = next((one for one in task.candidates if one.answers is not None), None)
    if truth is None or base is None or candidate is None:
        return None
    found = mask(Terms(ground=base, candidate=candidate, witness=truth).classes, base.edges)
    return {
        "configuration": candidate.name,
        "height": found.shape[0],
        "width": found.shape[1],
        "data": pack(found.tobytes()),
    }


def _write_files(task: JudgeTask, renders: Mapping[str, StageImages]) -> dict[str, str]:
    """Write one EXR per renderer; return renderer -> relative path."""
    written: dict[str, str] = {}
    lights = len(task.case.scene.lights)
    for name, images in renders.items():
        path = Path("images", place_of(task.case.name), f"{name.replace('/', '+')}.exr")
        (task.folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_answers(task.folder / path, images, lights=lights, comments=_comments(name, task.subject))
        written[name] = path.as_posix()
    return written


def _comments(renderer: str, subject: Subject) -> str:
    """Return what an image's header must say of who made it: a wrong formula shouts here too."""
    if not subject.is_tracer or not renderer.startswith(f"{TRACER}-"):
        return renderer
    from rayproof.tracer.configuration import Configuration  # and with it Dr.Jit, which no other judgement needs

    configuration = Configuration.parse(renderer.removeprefix(f"{TRACER}-"))
    wrong = (*configuration.faults, *configuration.controls)
    return f"PLANTED FAULT: {', '.join(wrong)}; {renderer}" if wrong else renderer
