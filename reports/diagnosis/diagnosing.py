"""A run's folder searched for the cause of its failures."""

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
from rayproof.reports.diagnosis.blaming import Blamed, guilty, narrowed, put
from rayproof.reports.diagnosis.clock import Clock
from rayproof.reports.diagnosis.saying import entries, of_images_that_change, what_is_left
from rayproof.reports.diagnosis.search import search, spread
from rayproof.reports.diagnosis.trial import Evidence, undecided
from rayproof.reports.results.float_codec import inflated
from rayproof.reports.results.images import inside, kept_images
from rayproof.reports.results.json_numbers import at_worst
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, CauseRecord, RepeatedRecord, RunRecord

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
    oracle, clock = Analytic(), Clock(seconds)
    evidence = {
        str(case["name"]): one
        for case in results["cases"]
        if (one := _evidence(folder, case, renderer, configuration, oracle)) is not None
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
            if check["verdict"] == Outcome.FAIL.value:
                count[check["configuration"]] = count.get(check["configuration"], 0) + 1
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
    verdicts = {check["verdict"] for check in case.get("checks", []) if check.get("configuration") == configuration}
    if Outcome.FAIL.value in verdicts:
        return Outcome.FAIL.value
    good = verdicts & {Outcome.PASS.value, Outcome.WARN.value}
    return (
        Outcome.PASS.value if good and not verdicts & {Outcome.ERROR.value, Outcome.REFERENCE_SUSPECT.value} else None
    )


def _evidence(folder: Path, case: CaseRecord, renderer: str, configuration: str, oracle: Analytic) -> Evidence | None:
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
