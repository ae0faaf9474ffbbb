"""The judge's task: judge a case, keep its images and scene, return its record."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange.framing import DARK
from rayproof.reports.judge.answers import Answers, well_shaped
from rayproof.reports.judge.case import adjudication, judge_case
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.repeated import add_note, repeated
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.reports.judge.sentinels import stand_guard
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.results.case_records import CaseRecord, MasksRecord, RepeatedRecord
from rayproof.reports.results.float_codec import pack
from rayproof.reports.results.images import write_answers, write_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.case_answers import CaseAnswers
from rayproof.reports.run.case_record import kinds_of, said, write_scene
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.pooled_factors import camera_and_lights
from rayproof.reports.run.scenes import FAMILY, place_of
from rayproof.reports.run.verdict_memory import ask_once
from rayproof.reports.subjects import TRACER, Subject


def keep_images(
    case: Case, options: CaseOptions, answers: CaseAnswers, folder: Path, outcome: Outcome
) -> tuple[dict[str, str], str | None]:
    """Write the renderers' images; return renderer -> EXR file, or the path of one file with all images.

    A case that passed has one file with the images of the first configuration and of the oracle, or of the independent
    references if the oracle has no answer. A warning has one file with the images of all renderers, any other case
    their EXR files. Nothing is written for a case whose images the run does not keep.
    """
    if not options.images.keeps(case.name, outcome):
        return {}, None
    everyone = options.images.full or outcome is not Outcome.PASS
    scene, subjects = case.scene, answers.subjects if everyone else answers.subjects[:1]
    oracle = any(reference.name == ORACLE and reference.answers for reference in answers.references)
    references = [
        reference
        for reference in answers.references
        if everyone or (reference.name == ORACLE if oracle else reference.independent)
    ]
    renderers = [
        (options.subject.renderer(renderer.name), well_shaped(scene, renderer).answers) for renderer in subjects
    ]
    renderers += [(renderer.name, well_shaped(scene, renderer).answers) for renderer in references]
    renders = {
        name: images
        for name, all_images in renderers
        if (images := {stage: image for stage, image in all_images.items() if stage in IMAGE_STAGES})
    }
    if options.images.full or outcome not in (Outcome.PASS, Outcome.WARN):
        return _write_files(case, options.subject, folder, renders), None
    if not renders:
        return {}, None
    path = Path("images", f"{place_of(case.name)}.js")
    scene_facts = {"camera": asdict(scene.camera), "lights": [*map(asdict, scene.lights)], "shading": scene.shading}
    write_pixels(folder / path, path.as_posix(), renders, scene_facts)
    return {}, path.as_posix()


def masks(answers: CaseAnswers, judged: Judged) -> MasksRecord | None:
    """Return the mask of the first configuration's pixels that nearby problems explain, as plain JSON data.

    None if the oracle has no answer.
    """
    subject = next((configuration for configuration in answers.subjects if configuration.error is None), None)
    if subject is None or subject.name not in judged.against:
        return None
    mask = judged.against[subject.name].mask
    return {
        "configuration": subject.name,
        "height": mask.shape[0],
        "width": mask.shape[1],
        "data": pack(mask.tobytes()),
    }


def _write_files(case: Case, subject: Subject, folder: Path, renders: Mapping[str, StageImages]) -> dict[str, str]:
    """Write one EXR per renderer; return renderer -> relative path."""
    written: dict[str, str] = {}
    lights = len(case.scene.lights)
    for name, images in renders.items():
        path = Path("images", place_of(case.name), f"{name.replace('/', '+')}.exr")
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_answers(folder / path, images, lights=lights, comments=_comments(name, subject))
        written[name] = path.as_posix()
    return written


def _comments(renderer: str, subject: Subject) -> str:
    """Return the renderer's name for an image's header, after a warning if it uses wrong formulas."""
    if not subject.is_tracer or not renderer.startswith(f"{TRACER}-"):
        return renderer
    from rayproof.tracer.configuration import Configuration  # and with it Dr.Jit, which no other judgement needs

    configuration = Configuration.parse(renderer.removeprefix(f"{TRACER}-"))
    wrong = (*configuration.faults, *configuration.controls)
    return f"PLANTED FAULT: {', '.join(wrong)}; {renderer}" if wrong else renderer


_ORACLE = Analytic()


@cache
def check_judge(*, cached: bool) -> None:
    """Run the judge's self-tests before the first case; raise BrokenJudgeError if any of them fails."""
    if cached:
        ask_once("judge", lambda: stand_guard(_ORACLE), usual_store())
    else:
        stand_guard(_ORACLE)


def compare_repeated(case: Case, first: Answers, again: Answers, *, varies: bool) -> RepeatedRecord:
    """Compare a second answer to a case with the first; `varies`: its images may differ within the limits."""
    base = scene_truth(case.scene, stages_of(case.scene), _ORACLE)
    return repeated(case.name, first, again, base, varies=varies)


def verdict(case: Case, answers: CaseAnswers, panel: tuple[str, ...] = ()) -> Judged:
    """Judge the answers to a case; a reference of the panel without an answer counts as missing."""
    judged = judge_case(case, answers.subjects, answers.references, _ORACLE, answers.versions, panel=panel)
    return of_what_is_supported(judged, answers.subjects)


def judge(case: Case, options: CaseOptions, answers: CaseAnswers, folder: Path) -> CaseRecord:
    """Judge a case, write its images and scene below `folder`, and return its record."""
    check_judge(cached=options.cached)
    judged = verdict(case, answers, options.references)
    for reference in answers.references:
        if reference.name in options.require and not reference.answers:
            why = reference.error or next(iter(reference.unsupported.values()), "it answered nothing")
            judged = judged.worsened(Outcome.FAIL, f"{reference.name} is required and could not answer: {why}")
    panel = adjudication(judged, answers.subjects, _ORACLE)
    scene = write_scene(folder, case)
    images, pixels = keep_images(case, options, answers, folder, judged.outcome)
    record = _record(case, options, answers, judged, scene, images)
    marked = masks(answers, judged) if images or pixels is not None else None  # drawn over images
    record.update({"adjudication": panel, "pixels": pixels, "masks": marked})
    if answers.again:
        about = {"base": judged.base, "varies": options.subject.varies}
        pairs = zip(answers.subjects, answers.again, strict=True)
        record["repeated"] = [repeated(case.name, first, again, **about) for first, again in pairs]
        for comparison in record["repeated"]:
            add_note(record, comparison, options.subject.name)
    return record


def _record(
    case: Case, options: CaseOptions, answers: CaseAnswers, judged: Judged, scene: str, images: dict[str, str]
) -> CaseRecord:
    """Return the case's record that docs/results.md describes."""
    subject = options.subject
    name_of = {subject.renderer(configuration.name): configuration for configuration in answers.subjects}
    errors = {name: configuration.error for name, configuration in name_of.items()} | {
        reference.name: reference.error for reference in answers.references
    }
    unable = [(name, configuration.unsupported) for name, configuration in name_of.items()] + [
        (reference.name, reference.unsupported) for reference in answers.references
    ]
    kept = {reference.name for reference in answers.references if reference.cached}
    notes = [(subject.name, note) for note in answers.notes] + [
        (reference.name, note) for reference in answers.references for note in (*reference.notes, *reference.mishaps)
    ]
    truth = {} if judged.base is None else judged.base.truth
    # Only for a user's scene: the suite's dark scenes are dark on purpose.
    dark = case.family == FAMILY and Stage.RADIANCE in truth and not (truth[Stage.RADIANCE] > 0).any()
    notes += [(ORACLE, DARK)] if dark else []
    record: CaseRecord = {
        "name": case.name,
        "family": case.family,
        "verdict": judged.outcome.value,
        "stage": judged.stage.value if judged.stage else None,
        "item": judged.blamed[0] if len(judged.blamed) == 1 else None,
        "reason": judged.reason,
        "stresses": case.stresses,
        "covers": list(case.covers),
        "planned": judged.planned,
        "scene": scene,
        "picture": None,
        "width": case.scene.camera.width,
        "height": case.scene.camera.height,
        "lights": len(case.scene.lights),
        "camera_and_lights": camera_and_lights(case.scene),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "settings": {reference.name: settings for reference in answers.references if (settings := said(reference))},
        "renders": [
            {
                "renderer": name,
                "configuration": name_of[name].name if name in name_of else None,
                "image": images.get(name),
                "error": error,
                "cached": name in kept,
            }
            for name, error in errors.items()
        ],
        "ran": {
            configuration.name: sorted(configuration.items)
            for configuration in answers.subjects
            if configuration.answers
        },
        "unsupported": [
            {"reference": name, "stage": stage.value, "why": why}
            for name, stages in unable
            for stage, why in stages.items()
        ],
        "abstained": {
            reference.name: reference.error for reference in answers.references if reference.error is not None
        },
        "stopped": [renderer.name for renderer in (*answers.subjects, *answers.references) if renderer.stopped],
        "notes": [{"reference": name, "note": note} for name, note in notes],
        "checks": [check.recorded() for check in judged.checks],
        "expectations": judged.expectations,
    }
    if dark:
        record["dark"] = True
    if not subject.is_tracer and subject.name not in REFERENCES:  # their limits are known
        record["kinds"] = kinds_of(case.scene, truth)
        record["refused"] = subject.capabilities.refusal(case.scene) is not None
    return record
