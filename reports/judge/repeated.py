"""Repeated rendering: whether a second image of a renderer equals the first to the last bit, and the changed pixels.

Changes from call to call are caused by a race between threads, uninitialised memory, or a random seed. A verdict on
such images holds for only one of them. A renderer may declare that its answers vary (`"deterministic": false`); then
two answers may differ by as much as those of two right renderers.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.measurement import jsonable
from rayproof.reports.results.case_records import RepeatedRecord
from rayproof.reports.results.outcomes import Outcome

if TYPE_CHECKING:
    from rayproof.reports.judge.scene_truth import SceneTruth


def changes(first: StageImages, again: StageImages) -> dict[Stage, np.ndarray]:
    """Return a mask (height, width) of pixels that differ in any bit, per differing stage; (1, 1) for whole stages."""
    differing = {}
    for stage in Stage:
        if stage not in first and stage not in again:
            continue
        image, repeated_image = first.get(stage), again.get(stage)
        if (
            stage is Stage.CAMERA
            or image is None
            or repeated_image is None
            or np.shape(image) != np.shape(repeated_image)
        ):
            differ = np.full((1, 1), not _same_matrices(image, repeated_image))
        else:
            differ = np.any(_bits_differ(np.asarray(image), np.asarray(repeated_image)), axis=-1)
        if differ.any():
            differing[stage] = differ
    return differing


def _bits_differ(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return a mask of different numbers, including the signs of zeros; all NaN are equal."""
    equal = (left == right) & (np.signbit(left) == np.signbit(right))
    return ~(equal | (np.isnan(left) & np.isnan(right)))


def _same_matrices(left: Any, right: Any) -> bool:
    if not isinstance(left, Mapping) or not isinstance(right, Mapping) or left.keys() != right.keys():
        return False
    return all(np.array_equal(left[part], right[part], equal_nan=True) for part in left)


def repeated(case: str, first: Answers, again: Answers, base: "SceneTruth | None", *, varies: bool) -> RepeatedRecord:
    """Return the record of a subject's second answer; `varies`: the subject declares that its answers vary.

    `base` is the truth of the case; without it, the size of the differences is not measured.
    """
    record: RepeatedRecord = {"configuration": first.name, "stage": None, "pixel": None, "differing": 0, "beyond": 0.0}
    if first.error is not None:  # its case is an error already
        return {**record, "verdict": Outcome.UNDECIDED.value, "sentence": ""}
    if again.error is not None:
        sentence = f"{first.name} was put to {case} twice, and the second time it ended in an error: {again.error}"
        return {**record, "verdict": Outcome.FAIL.value, "sentence": sentence}
    differ = changes(first.answers, again.answers)
    if not differ:
        return {**record, "verdict": Outcome.PASS.value, "sentence": ""}
    stage, where = next(iter(differ.items()))
    row, column = (int(place) for place in np.argwhere(where)[0])
    beyond, worst = _beyond(first, again, base)
    record |= {
        "stage": stage.value,
        "pixel": [column, row],
        "differing": int(np.count_nonzero(where)),
        "beyond": jsonable(float(f"{beyond:.4g}")),
    }
    if varies and beyond <= 1:
        return {**record, "verdict": Outcome.PASS.value, "sentence": ""}
    if varies:
        sentence = (
            f"{first.name} declares that its answers vary, and two to {case} differ by more than right ones may: "
            f"{worst} by {beyond:.3g} times the limit"
        )
        return {**record, "verdict": Outcome.FAIL.value, "sentence": sentence}
    sentence = (
        f"{first.name} answers {case} differently when it is asked again: {record['differing']} of {where.size} pixels "
        f"of {stage} differ, the first at ({column}, {row})" + ("" if beyond <= 1 else f", {worst} beyond the limits")
    )
    return {**record, "verdict": Outcome.FAIL.value, "sentence": sentence}


def _beyond(first: Answers, again: Answers, base: "SceneTruth | None") -> tuple[float, str]:
    """Return the largest difference of two answers over that allowed for two right answers, and its stage."""
    images, repeated_images = first.answers, again.answers
    if images.keys() != repeated_images.keys():
        return np.inf, "the stages that it writes"
    if base is None:
        return 0.0, ""
    worst, worst_stage = 0.0, ""
    # Imported here because images rarely differ, and these modules import much of the judge.
    from rayproof.reports.judge.against_oracle import AgainstOracle
    from rayproof.reports.judge.pairs import Pair

    pair = Pair(AgainstOracle(base, first), AgainstOracle(base, replace(again, name=f"{first.name}, asked again")))
    for stage in IMAGE_STAGES:
        if stage not in images:
            continue
        if np.shape(images[stage]) != np.shape(base.truth[stage]) or np.shape(images[stage]) != np.shape(
            repeated_images[stage]
        ):
            return np.inf, stage.value
        pixels = pair.pixels(stage)
        ratio = float(np.where(pixels.explained, 0.0, pixels.ratio).max())
        if not ratio <= worst:
            worst, worst_stage = (np.inf if np.isnan(ratio) else ratio), stage.value
    return worst, worst_stage
