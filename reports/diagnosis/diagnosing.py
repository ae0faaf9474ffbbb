"""`diagnose`: a results folder's failures become causes in sentences, with evidence and what is left."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import numpy as np

from rayproof.cases.case import BLAMABLE
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.answering import PRECISION
from rayproof.reports.diagnosis.blaming import Blamed, guilty, narrowed, put
from rayproof.reports.diagnosis.hypotheses import Clock
from rayproof.reports.diagnosis.search import Found, Searched, search, spread
from rayproof.reports.diagnosis.trials import Evidence, differ, trial, undecided
from rayproof.reports.judge.forward.limits import Roundoff, roundoff_of
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.results.files import at_worst, several
from rayproof.reports.results.float_codec import inflated
from rayproof.reports.results.images import inside, kept_images
from rayproof.reports.results.outcomes import TITLES, Outcome
from rayproof.reports.results.records import AlternativeRecord, CauseRecord, RunRecord

FEW = 4  # items that are told by name
CHANGING = "changes_from_call_to_call"  # no hypothesis: its pixels cannot be foretold


def entries(
    searched: Searched, failing: Sequence[Evidence], others: Sequence[Evidence], *, of: int
) -> list[CauseRecord]:
    """Return one entry for each cause; where nothing fits, one that says so.

    `failing` are the cases to be explained, `of` how many failed, `others` cases beyond the run that may tell apart
    what the run does not.
    """
    if not searched.found:
        return [_nothing(searched, of)] if searched.tried else []
    found = sorted(searched.found, key=_preference)
    # Ways of one mistake are one mistake.
    by_name: dict[tuple[str, ...], Found] = {}
    for one in found:
        by_name.setdefault((*sorted(one.hypothesis.mistakes), one.hypothesis.way.says or ""), one)
    members = list(by_name.values())
    first = members[0]
    # A factor that is estimated to be pi says nothing beside "leaves out 1/pi".
    plain = not first.hypothesis.parameters
    rest = [one for one in members[1:] if not (plain and one.hypothesis.parameters)]
    explained = [case.case for case in failing if _explains(first, case)]
    predicted = [name for name in explained if name not in searched.fitted]
    telling = {
        member.hypothesis.sentence: next(
            (case.case for case in others if differ(case, first.hypothesis.way, member.hypothesis.way)), None
        )
        for member in rest
    }
    told_apart = next((name for name in telling.values() if name is not None), None)
    found_entries: list[CauseRecord] = []
    for name in first.hypothesis.mistakes:
        mistake = MISTAKES[name]
        parameter = first.hypothesis.parameters.get(name)
        beside = [other for other in first.hypothesis.mistakes if other != name]
        alternatives: list[AlternativeRecord] = [
            {
                "mistake": "+".join(member.hypothesis.mistakes),
                "sentence": member.hypothesis.sentence,
                "items": list(member.hypothesis.items),
                "parameters": {**member.hypothesis.parameters},
            }
            for member in rest
            if name not in member.hypothesis.mistakes or member.hypothesis.way.says is not None
        ]
        phrase = first.hypothesis.phrase(name)
        found_entries.append(
            {
                "mistake": name,
                "items": list(mistake.items),
                "sentence": _sentence(phrase, mistake.items, len(explained), of, beside, alternatives, told_apart),
                "explains": {"cases": len(explained), "of": of},
                "cases": explained,
                "with": beside,
                "alternatives": alternatives,
                "told_apart_by": told_apart,
                "predicted": {"cases": len(predicted), "of": of - len(searched.fitted)},
                "parameters": {} if parameter is None else {name: parameter},
                "tried": searched.tried,
            }
        )
    return found_entries


def _preference(found: Found) -> tuple[int, bool, int]:
    """Return what puts a plain mistake before an estimated one, and one mistake before two."""
    estimated = bool(found.hypothesis.parameters)
    traced = bool(found.hypothesis.way.formulas)
    return len(found.hypothesis.mistakes), estimated, traced


def _explains(found: Found, case: Evidence) -> bool:
    seen = MISTAKES[found.hypothesis.mistakes[0]].seen
    if seen is not None:
        return seen(case) is True
    tally = found.tallies.get(case.case)
    if tally is None:
        tally = trial(case, found.hypothesis.way)
    return tally is not None and tally.explains


def _sentence(
    phrase: str,
    items: Sequence[str],
    cases: int,
    of: int,
    beside: Sequence[str],
    alternatives: Sequence[AlternativeRecord],
    told_apart: str | None,
) -> str:
    named = ", ".join(f"{item} {TITLES[item]}" for item in items)
    said = f"The renderer {phrase} [{named}]: this explains {cases} of {several(of, 'failing case')}"
    if beside:
        said += f", together with: it {' and '.join(MISTAKES[name].says for name in beside)}"
    if alternatives:
        said += f". The same pixels come of one that {', or '.join(one['sentence'] for one in alternatives)}"
        said += f"; {told_apart} would tell" if told_apart is not None else "; no case that was asked tells them apart"
    return f"{said}."


def of_images_that_change(repeated: RepeatedRecord, case: str, failing: Sequence[str], *, of: int) -> CauseRecord:
    """Return the cause of failures of a renderer whose images differ from call to call by more than right ones may."""
    item = "IMG-1"
    said = (
        f"The renderer writes another image each time it is asked [{item} {TITLES[item]}]: in {case} two differ in "
        f"{repeated['differing']} pixels of {repeated['stage']}, beyond the limits. No formula is looked for in "
        f"{len(failing)} of {several(of, 'failing case')}, since images that change prove nothing."
    )
    found = _no_mistake(said, of=of, tried=0)
    found["explains"]["cases"] = len(failing)
    return {**found, "mistake": CHANGING, "items": [item], "cases": list(failing)}


def what_is_left(cases: Sequence[CaseRecord]) -> str:
    """Return in a sentence which items the cases that nothing explains leave, and which are excluded in all of them."""
    told = [case for case in cases if case.get("blamed_items")]
    if not told:
        return ""
    left = [item for item in TITLES if any(item in case["blamed_items"] for case in told)]
    out = {
        item: next(check for case in told if (check := case["excluded"].get(item)) is not None)
        for item in TITLES
        if item not in left and any(item in case["excluded"] for case in told)
    }
    named = " or ".join(f"{item} {TITLES[item]}" for item in left)
    said = f"To blame is {named}." if len(left) <= FEW else f"{len(left)} items may be to blame."
    if out:
        said += f" Excluded: {', '.join(f'{item} (by {check})' for item, check in out.items())}."
    return said


def _nothing(searched: Searched, of: int) -> CauseRecord:
    stopped = "" if searched.finished else " (the search was stopped at its time limit)"
    said = f"None of {searched.tried} known mistakes explains the {several(of, 'failing case')}{stopped}."
    return _no_mistake(said, of=of, tried=searched.tried)


def _no_mistake(sentence: str, *, of: int, tried: int) -> CauseRecord:
    return {
        "mistake": None,
        "items": [],
        "sentence": sentence,
        "explains": {"cases": 0, "of": of},
        "cases": [],
        "with": [],
        "alternatives": [],
        "told_apart_by": None,
        "predicted": None,
        "parameters": {},
        "tried": tried,
    }


GEOMETRY = IMAGE_STAGES[: IMAGE_STAGES.index(Stage.VISIBILITY)]
LARGEST = 2000  # faces: of a larger mesh nearly every pixel is an edge, and edges prove nothing
FOR_BLAME = 4.0  # s of processor time that the search for a cause leaves
MOST_OTHERS = 30  # cases beyond the run that are asked whether they tell two mistakes apart


def diagnose(folder: Path, results: RunRecord, *, seconds: float) -> list[CauseRecord]:
    """Return the causes of a run's failures as `diagnosis` of results.json; none where nothing failed by its pixels.

    What is blamed in the cases is narrowed to what a cause or the known mistakes leave of it.
    """
    renderer, configuration = _worst(results)
    if renderer is None:
        return []
    oracle, clock, rounding = Analytic(), Clock(seconds), _rounding(results)
    evidence = {
        str(case["name"]): one
        for case in results["cases"]
        if (one := _evidence(folder, case, renderer, configuration, oracle, rounding)) is not None
    }
    failing = spread([one for one in evidence.values() if one.failed])
    changing = _changing(results, configuration)
    searched = search(list(evidence.values()), seconds=seconds - FOR_BLAME)
    if not searched.tried:
        return []
    others: Sequence[Evidence] = ()
    if len({tuple(sorted(one.hypothesis.mistakes)) for one in searched.found}) > 1:
        others = _others(set(evidence), failing[0].stages, oracle)
    failed = sum(_verdict(case, configuration) == Outcome.FAIL.value for case in results["cases"])
    causes = cast("list[CauseRecord]", entries(searched, failing, others, of=failed))
    if changing is not None and not searched.found:
        causes = [of_images_that_change(*changing, [one.case for one in failing], of=failed)]
    narrow(results, evidence, configuration, causes, seconds=max(FOR_BLAME, seconds - clock.spent))
    return causes


def _changing(results: RunRecord, configuration: str) -> tuple[RepeatedRecord, str] | None:
    """Return what came of asking a renderer twice, and of which case, if that differs beyond the limits; else None."""
    for case in results["cases"]:
        for one in case.get("repeated", []):
            if one["configuration"] == configuration and one["verdict"] == Outcome.FAIL and at_worst(one["beyond"]) > 1:
                return one, str(case["name"])
    return None


def narrow(
    results: RunRecord,
    evidence: Mapping[str, Evidence],
    configuration: str,
    causes: list[CauseRecord],
    *,
    seconds: float,
) -> None:
    """Write into the failing cases' records which items are left to blame; of what nothing explains, say it too."""
    named: dict[str, list[str]] = {}
    for cause in causes:
        for case in cause["cases"]:
            told = [cause["items"], *(other["items"] for other in cause["alternatives"])]
            named.setdefault(case, []).extend(item for items in told for item in items)
    open_cases = []
    for case in results["cases"]:
        known = evidence.get(str(case["name"]))
        if "blamed_items" not in case or known is None or guilty(case) != configuration:
            continue
        if case["name"] in named:
            put(case, Blamed(items=tuple(item for item in BLAMABLE if item in named[case["name"]])))
        else:
            open_cases.append((case, known, Blamed(items=tuple(case["blamed_items"]))))
    passed = [
        (case, known)
        for case in results["cases"]
        if (known := evidence.get(str(case["name"]))) is not None and not known.failed
    ]
    found = narrowed(open_cases, passed, configuration, seconds=seconds)
    for case, _, _ in open_cases:
        if case["name"] in found:
            put(case, found[case["name"]])
    for cause in causes:
        if cause["mistake"] is None:
            asked = [case for case, _, _ in open_cases if case["name"] in found]
            cause["sentence"] = f"{cause['sentence']} {what_is_left(asked)}".rstrip()


def _worst(results: RunRecord) -> tuple[str | None, str]:
    """Return the renderer under test whose checks fail most, as its images and as its checks name it."""
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
    """Return whether a renderer fails in a case or passes; None where neither is known."""
    verdicts = {check.outcome for check in case.get("checks", []) if check.configuration == configuration}
    if Outcome.FAIL.value in verdicts:
        return Outcome.FAIL.value
    good = verdicts & {Outcome.PASS.value, Outcome.WARN.value}
    return (
        Outcome.PASS.value if good and not verdicts & {Outcome.ERROR.value, Outcome.REFERENCE_SUSPECT.value} else None
    )


def _rounding(results: RunRecord) -> Roundoff:
    """Return how the renderer under test rounds, as far as it is known or declares it."""
    world = bool(results["declared"].get("world_normals"))
    return roundoff_of(str(results.get("subject", "")), PRECISION, world_normals=world)


def _evidence(
    folder: Path, case: CaseRecord, renderer: str, configuration: str, oracle: Analytic, rounding: Roundoff
) -> Evidence | None:
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
        found, _ = kept_images(folder, case, only=[renderer])
        return {
            stage: np.asarray(image, dtype=np.float64)
            for stage, image in found.get(renderer, {}).items()
            if stage in IMAGE_STAGES
        }

    return Evidence(
        case=str(case["name"]),
        scene=scene,
        load=images,
        failed=verdict == Outcome.FAIL.value,
        oracle=oracle,
        undecided=_mask(case, configuration),
        rounding=rounding,
    )


def faces(scene: Scene) -> int:
    """Return how many triangles a scene's meshes have."""
    return sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))


def _mask(case: CaseRecord, configuration: str) -> np.ndarray | None:
    """Return the pixels that the judge left undecided, as the record has them; None where it has not."""
    kept = case.get("masks")
    if not isinstance(kept, Mapping) or kept.get("configuration") != configuration:
        return None
    try:
        height, width = int(kept["height"]), int(kept["width"])
        flags = np.frombuffer(inflated(str(kept["data"]), height * width), dtype=np.uint8)
        return flags.reshape(height, width) > 0
    except (KeyError, TypeError, ValueError):
        return None


def _others(run: set[str], stages: Sequence[Stage], oracle: Analytic) -> list[Evidence]:
    """Return cases of the suite beyond a run, as if they had been answered rightly in these stages."""
    found = []
    for case in all_cases():
        if case.name in run or faces(case.scene) > LARGEST:
            continue

        def images(scene: Scene = case.scene) -> dict[Stage, np.ndarray]:
            answers = oracle.render(scene, [stage for stage in stages if scene.lights or stage in GEOMETRY])
            return dict(answers)

        found.append(
            Evidence(case=case.name, scene=case.scene, load=images, failed=False, oracle=oracle, undecided=None)
        )
    return spread(found)[:MOST_OTHERS]


__all__ = ["diagnose", "faces", "undecided"]
