"""`diagnose`: find the causes of a run's failures, as sentences with their evidence and the remaining items."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from rayproof.cases.case import BLAMABLE
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis.blaming import Blamed, guilty, narrowed, put
from rayproof.reports.diagnosis.evidence import Evidence
from rayproof.reports.diagnosis.findings import Finding, acne, blank, coarse, noise, not_drawn, one_light, swapped
from rayproof.reports.diagnosis.search import Cause, Searched, search, spread
from rayproof.reports.mistakes import MISTAKES, Mistake
from rayproof.reports.mistakes.storing import Coded
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.results.files import at_worst, several
from rayproof.reports.results.images import inside, kept_images
from rayproof.reports.results.outcomes import TITLES, Outcome
from rayproof.reports.results.records import AlternativeRecord, CauseRecord, RunRecord

FAILURE = "failing case"
FEW = 4  # items that a sentence lists by name; more are only counted
CHANGING = "changes_from_call_to_call"  # not a mistake of the registry, since its pixels cannot be predicted
LARGEST = 2000  # faces; rendering a larger mesh with each mistake is too slow
MOST_OTHERS = 40  # cases outside the run that are searched for a difference between two mistakes
APART = 0.05  # share of a sample of pixels; a case distinguishes mistakes that differ in more


def faces(scene: Scene) -> int:
    """Return the number of triangles in a scene's meshes."""
    return sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))


def causes_of(cases: Sequence[Evidence]) -> tuple[list[Finding], Searched]:
    """Return the findings about images as a whole, and the mistakes that explain the failing cases of a run."""
    failing = spread([case for case in cases if case.failed and case.stages])
    passing = [case for case in cases if not case.failed and case.stages]
    findings: list[Finding] = []
    if not failing:
        return findings, Searched()
    if (finding := blank([*failing, *passing], failing)) is not None:
        return [finding], Searched(left=[case for case in failing if case not in finding.cases], tried=1)
    if (finding := swapped([*failing, *passing], failing)) is not None:
        findings.append(finding)
        failing = [case for case in failing if case not in finding.cases]
    coded = [MISTAKES[name] for name in MISTAKES if issubclass(MISTAKES[name], Coded)]
    stored = any(
        all(case.explains(variant) for case in failing[:2])
        for mistake in coded
        for variant in (mistake, *mistake.variants)
    )
    if not stored and (finding := coarse([*failing, *passing], failing)) is not None:
        if finding.cases:
            findings.append(finding)
        failing = [case for case in failing if case not in finding.cases]
    searched = search(failing, passing, not_drawn(failing))
    for last in (one_light, acne, noise):
        if searched.left and (finding := last(searched.left)) is not None:
            findings.append(finding)
            searched.left = [case for case in searched.left if case not in finding.cases]
            if searched.left:
                again = search(searched.left, passing)
                searched.causes, searched.left = [*searched.causes, *again.causes], again.left
    return findings, searched


def entries(
    findings: Sequence[Finding],
    searched: Searched,
    *,
    of: int,
    others: Sequence[Evidence] = (),
    failures: str = FAILURE,
) -> list[CauseRecord]:
    """Return a record for each cause; without any cause, a single record with this result. `of` cases failed.

    `others` are cases outside the run, which may distinguish mistakes that the run's cases do not. `failures` is the
    noun for a failing case in sentences.
    """
    records = [_of_finding(finding, of=of, tried=searched.tried) for finding in findings]
    for cause in searched.causes:
        records += _of_cause(cause, of=of, tried=searched.tried, others=others)
    if not records and searched.tried:
        sentence = f"None of {searched.tried} known mistakes explains the {several(of, failures)}."
        records.append(_record(None, (), sentence, (), of=of, tried=searched.tried))
    for record in records:
        if record["mistake"] is not None:
            record["sentence"] = record["sentence"].replace(several(of, FAILURE), several(of, failures), 1)
    return records


def _of_finding(finding: Finding, *, of: int, tried: int) -> CauseRecord:
    sentence = _sentence(finding.sentence, finding.items, len(finding.cases), of)
    names = [case.case for case in finding.cases]
    return _record(finding.name, finding.items, f"{sentence}.", names, of=of, tried=tried)


def _of_cause(cause: Cause, *, of: int, tried: int, others: Sequence[Evidence]) -> list[CauseRecord]:
    parts = cause.mistake.parts or (cause.mistake,)
    names, records = [case.case for case in cause.cases], []
    alternatives: list[AlternativeRecord] = [
        {
            "mistake": mistake.name,
            "sentence": mistake.sentence,
            "items": list(mistake.items),
            "parameters": {**mistake.parameters},
        }
        for mistake in cause.alternatives
    ]
    apart = next(
        (case.case for case in others for entry in cause.alternatives if _apart(case, cause.mistake, entry)),
        None,
    )
    for part in parts:
        text = _sentence(part.sentence, part.items, len(names), of)
        partners = [mistake for mistake in parts if mistake is not part]
        if partners:
            text += f", together with: it {' and '.join(mistake.sentence for mistake in partners)}"
        if alternatives:
            text += f". The same pixels come of one that {', or '.join(entry['sentence'] for entry in alternatives)}"
            text += f"; {apart} would tell" if apart else "; no case that was asked tells them apart"
        record = _record(part.name, part.items, f"{text}.", names, of=of, tried=tried)
        fitted = len(cause.fitted)
        record["with"], record["alternatives"] = [mistake.name for mistake in partners], alternatives
        record["told_apart_by"], record["parameters"] = apart, {**part.parameters}
        record["predicted"] = {"cases": len(names) - fitted, "of": of - fitted}
        records.append(record)
    return records


def _sentence(phrase: str, items: Sequence[str], cases: int, of: int) -> str:
    named = ", ".join(f"{item} {TITLES[item]}" for item in items)
    return f"The renderer {phrase} [{named}]: this explains {cases} of {several(of, 'failing case')}"


def _record(
    name: str | None, items: Sequence[str], sentence: str, cases: Sequence[str], *, of: int, tried: int
) -> CauseRecord:
    return {
        "mistake": name,
        "items": list(items),
        "sentence": sentence,
        "explains": {"cases": len(cases), "of": of},
        "cases": list(cases),
        "with": [],
        "alternatives": [],
        "told_apart_by": None,
        "predicted": None,
        "parameters": {},
        "tried": tried,
    }


def _apart(case: Evidence, first: type[Mistake], second: type[Mistake]) -> bool:
    return bool(case.off_each_other(first(), second()).mean() > APART)


def of_images_that_change(repeated: RepeatedRecord, case: str, failing: Sequence[str], *, of: int) -> CauseRecord:
    """Return the record of a renderer whose images differ from call to call by more than the limits."""
    item = "IMG-1"
    sentence = (
        f"The renderer writes another image each time it is asked [{item} {TITLES[item]}]: in {case} two differ in "
        f"{repeated['differing']} pixels of {repeated['stage']}, beyond the limits. Its first images are diagnosed."
    )
    return _record(CHANGING, (item,), sentence, failing, of=of, tried=0)


def what_is_left(cases: Sequence[CaseRecord]) -> str:
    """Return a sentence on the remaining items of unexplained cases, and on the items that are excluded in all."""
    with_items = [case for case in cases if case.get("blamed_items")]
    if not with_items:
        return ""
    left = [item for item in TITLES if any(item in case["blamed_items"] for case in with_items)]
    out = {
        item: next(check for case in with_items if (check := case["excluded"].get(item)) is not None)
        for item in TITLES
        if item not in left and any(item in case["excluded"] for case in with_items)
    }
    named = " or ".join(f"{item} {TITLES[item]}" for item in left)
    sentence = f"To blame is {named}." if len(left) <= FEW else f"{len(left)} items may be to blame."
    if out:
        sentence += f" Excluded: {', '.join(f'{item} (by {check})' for item, check in out.items())}."
    return sentence


def diagnose(folder: Path, results: RunRecord, *, accepted: Collection[str] = ()) -> list[CauseRecord]:
    """Return the causes of a run's failures, the `diagnosis` of results.json; none if no case failed by its pixels.

    Also narrow the blamed items of the cases' records to those of a cause, or to those that the known mistakes do not
    exclude. Causes of `accepted` failures are searched separately, and come last.
    """
    renderer, configuration = _worst(results)
    if renderer is None:
        return []
    evidence = {
        str(case["name"]): case_evidence
        for case in results["cases"]
        if (case_evidence := _evidence(folder, case, renderer, configuration, results)) is not None
    }
    causes: list[CauseRecord] = []
    for is_accepted in (False, True):
        failing = [case for case in evidence.values() if case.failed and (case.case in accepted) is is_accepted]
        if failing:
            passing = [case for case in evidence.values() if not case.failed]
            causes += _records([*failing, *passing], results, configuration, known=is_accepted, accepted=accepted)
    changing = _changing(results, configuration)
    if changing is not None:
        names = [case.case for case in evidence.values() if case.failed]
        mistakes = [cause for cause in causes if cause["mistake"] is not None]
        causes = [of_images_that_change(*changing, [] if mistakes else names, of=len(names)), *mistakes]
    narrow(results, evidence, configuration, causes)
    return causes


def _records(
    cases: Sequence[Evidence], results: RunRecord, configuration: str, *, known: bool, accepted: Collection[str]
) -> list[CauseRecord]:
    findings, searched = causes_of(cases)
    failed = sum(
        _verdict(case, configuration) == Outcome.FAIL.value and (str(case["name"]) in accepted) is known
        for case in results["cases"]
    )
    others: Sequence[Evidence] = ()
    if any(cause.alternatives for cause in searched.causes):
        others = _others({str(case["name"]) for case in results["cases"]}, cases[0].stages)
    return entries(findings, searched, of=failed, others=others, failures="accepted failure" if known else FAILURE)


def _changing(results: RunRecord, configuration: str) -> tuple[RepeatedRecord, str] | None:
    """Return the record of a repeated render that differs beyond the limits, and its case's name; None without any."""
    for case in results["cases"]:
        for repeated in case.get("repeated", []):
            if (
                repeated["configuration"] == configuration
                and repeated["verdict"] == Outcome.FAIL
                and at_worst(repeated["beyond"]) > 1
            ):
                return repeated, str(case["name"])
    return None


def narrow(
    results: RunRecord, evidence: Mapping[str, Evidence], configuration: str, causes: Sequence[CauseRecord]
) -> None:
    """Write the remaining items into the failing cases' records, and add them to the sentence on unexplained cases."""
    named: dict[str, list[str]] = {}
    for cause in causes:
        for case in cause["cases"]:
            lists = [cause["items"], *(alternative["items"] for alternative in cause["alternatives"])]
            named.setdefault(case, []).extend(item for items in lists for item in items)
    open_cases = []
    for case in results["cases"]:
        case_evidence = evidence.get(str(case["name"]))
        if "blamed_items" not in case or case_evidence is None or guilty(case) != configuration:
            continue
        if case["name"] in named:
            put(case, Blamed(items=tuple(item for item in BLAMABLE if item in named[case["name"]])))
        else:
            open_cases.append((case, case_evidence, Blamed(items=tuple(case["blamed_items"]))))
    passed = [
        (case, case_evidence)
        for case in results["cases"]
        if (case_evidence := evidence.get(str(case["name"]))) is not None and not case_evidence.failed
    ]
    remaining = narrowed(open_cases, passed, configuration)
    for case, _, _ in open_cases:
        put(case, remaining[case["name"]])
    for cause in causes:
        if cause["mistake"] is None:
            cause["sentence"] = f"{cause['sentence']} {what_is_left([case for case, _, _ in open_cases])}".rstrip()


def _worst(results: RunRecord) -> tuple[str | None, str]:
    """Return the renderer under test with the most failed checks: its name among the images, and its configuration."""
    count: dict[str, int] = {}
    for case in results["cases"]:
        for check in case.get("checks", []):
            if check.outcome is Outcome.FAIL:
                count[check.configuration] = count.get(check.configuration, 0) + 1
    if not count:
        return None, ""
    configuration = max(count, key=lambda name: count[name])
    for case in results["cases"]:
        for render in case.get("renders", []):
            if render.get("configuration") == configuration:
                return str(render["renderer"]), configuration
    return None, ""


def _verdict(case: CaseRecord, configuration: str) -> str | None:
    """Return whether a configuration fails or passes in a case; None if neither is certain."""
    verdicts = {check.outcome for check in case.get("checks", []) if check.configuration == configuration}
    if Outcome.FAIL.value in verdicts:
        return Outcome.FAIL.value
    good = verdicts & {Outcome.PASS.value, Outcome.WARN.value}
    return (
        Outcome.PASS.value if good and not verdicts & {Outcome.ERROR.value, Outcome.REFERENCE_SUSPECT.value} else None
    )


def _evidence(folder: Path, case: CaseRecord, renderer: str, configuration: str, results: RunRecord) -> Evidence | None:
    verdict, path = _verdict(case, configuration), case.get("scene")
    if verdict is None or not isinstance(path, str) or not inside(folder, path):
        return None
    try:
        scene = load_scene(folder / path)
    except (OSError, SceneError, ValueError):
        return None
    if faces(scene) > LARGEST:
        return None

    def images() -> dict[Stage, np.ndarray]:
        kept, _ = kept_images(folder, case, only=[renderer])
        return {stage: image for stage, image in kept.get(renderer, {}).items() if stage in IMAGE_STAGES}

    return Evidence(
        case=str(case["name"]),
        scene=scene,
        load=images,
        failed=verdict == Outcome.FAIL.value,
        name=str(results.get("subject", "")),
        world_normals=bool(results["declared"].get("world_normals")),
    )


def _others(run: set[str], stages: Sequence[Stage]) -> list[Evidence]:
    """Return cases of the suite outside a run, with the right images of these stages in place of a renderer's."""
    cases = [
        Evidence(
            case=case.name,
            scene=case.scene,
            load=lambda scene=case.scene: Analytic().render(scene, stages),
            failed=False,
        )
        for case in all_cases()
        if case.name not in run and case.samples == 1 and faces(case.scene) <= LARGEST and case.scene.lights
    ]
    return spread(cases)[:MOST_OTHERS]
