"""The comparison of two renders of the same scene by the same renderer, pixel by pixel.

Pixels that change from call to call are due to a race between threads, uninitialised memory, or a new random seed. The
verdict on such images is valid for a single render only. A program is repeatable if two of its images differ by no more
than two right renderers may, or by a millionth of the image's largest value. A program that declares
`"deterministic": true`, the tracer and the references must repeat their images to the last bit.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.measurement import jsonable
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.results.outcomes import Outcome

if TYPE_CHECKING:
    from rayproof.reports.judge.scene_truth import SceneTruth


NOTHING = 1e-6  # of the largest light of an image: the rounding of threads that add up light in another order


def changes(first: StageImages, again: StageImages) -> dict[Stage, np.ndarray]:
    """Return the mask (height, width) of the pixels that differ in any bit, for each stage with such a pixel.

    The mask of a stage without comparable images (camera, missing image, different shapes) has shape (1, 1).
    """
    masks = {}
    for stage in Stage:
        if stage not in first and stage not in again:
            continue
        first_image, second_image = first.get(stage), again.get(stage)
        if (
            stage is Stage.CAMERA
            or first_image is None
            or second_image is None
            or np.shape(first_image) != np.shape(second_image)
        ):
            differ = np.full((1, 1), not _same_matrices(first_image, second_image))
        else:
            differ = np.any(_bits_differ(np.asarray(first_image), np.asarray(second_image)), axis=-1)
        if differ.any():
            masks[stage] = differ
    return masks


def _bits_differ(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the mask of the elements that differ between two arrays, also by a zero's sign; all NaNs are equal."""
    same = (first == second) & (np.signbit(first) == np.signbit(second))
    return ~(same | (np.isnan(first) & np.isnan(second)))


def _same_matrices(first: Any, second: Any) -> bool:
    if not isinstance(first, Mapping) or not isinstance(second, Mapping) or first.keys() != second.keys():
        return False
    return all(np.array_equal(first[part], second[part], equal_nan=True) for part in first)


def repeated(case: str, first: Answers, again: Answers, base: "SceneTruth | None", *, varies: bool) -> RepeatedRecord:
    """Return the record of a subject's second render; if `varies`, its images may differ within the limits.

    `base` is the truth by which the case was judged; without it, the size of the differences is not measured.
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
    beyond, worst, share = _beyond(first, again, base)
    record |= {
        "stage": stage.value,
        "pixel": [column, row],
        "differing": int(np.count_nonzero(where)),
        "beyond": jsonable(float(f"{beyond:.4g}")),
    }
    if varies and base is not None and beyond <= 1:
        sentence = (
            f"It repeats to {share:.2g} of the largest value: {record['differing']} of {where.size} pixels differ."
        )
        return {**record, "verdict": Outcome.PASS.value, "sentence": sentence}
    sentence = (
        f"{first.name} answers {case} differently when it is asked again: {record['differing']} of {where.size} pixels "
        f"of {stage} differ, the first at ({column}, {row})"
        + ("" if beyond <= 1 else f", {worst} by {beyond:.3g} times the limit")
    )
    return {**record, "verdict": Outcome.FAIL.value, "sentence": sentence}


def add_note(record: CaseRecord, repeated: RepeatedRecord, subject: str) -> None:
    """Add a note to a case whose images differ within the limits: the difference as a share of the largest value."""
    if repeated["verdict"] == Outcome.PASS and repeated["sentence"]:
        record["notes"] = [*record.get("notes", []), {"reference": subject, "note": repeated["sentence"]}]


def _beyond(first: Answers, again: Answers, base: "SceneTruth | None") -> tuple[float, str, float]:
    """Return the largest ratio of a difference to the limit for two right renderers, and its stage.

    The last number is the largest difference as a share of its stage's largest value.
    """
    first_images, second_images = first.answers, again.answers
    if first_images.keys() != second_images.keys():
        return np.inf, "the stages that it writes", np.inf
    if base is None:
        return 0.0, "", 0.0
    worst, worst_stage, share = 0.0, "", 0.0
    # Imported only if images differ: these modules load much of the judge.
    from rayproof.reports.judge.against_oracle import AgainstOracle
    from rayproof.reports.judge.pairs import RendererPair

    pair = RendererPair(
        AgainstOracle(base, first), AgainstOracle(base, replace(again, name=f"{first.name}, asked again"))
    )
    for stage in IMAGE_STAGES:
        if stage not in first_images:
            continue
        if np.shape(first_images[stage]) != np.shape(base.truth[stage]) or np.shape(first_images[stage]) != np.shape(
            second_images[stage]
        ):
            return np.inf, stage.value, np.inf
        pixels = pair.pixels(stage)
        with np.errstate(invalid="ignore", divide="ignore"):  # of images with infinite and with no values
            apart = np.nan_to_num(np.abs(first_images[stage] - second_images[stage]), nan=0.0).max(axis=-1)
            apart = apart / np.nan_to_num(np.abs(base.truth[stage]), nan=0.0, posinf=0.0).max(initial=0.0)
        share = max(share, float(np.nan_to_num(apart).max(initial=0.0)))
        nothing = (apart <= NOTHING) & (stage in LIGHT) & np.isfinite(first_images[stage]).all(axis=-1)
        ratio = float(np.where(pixels.explained | nothing, 0.0, pixels.ratio).max())
        if not ratio <= worst:
            worst, worst_stage = (np.inf if np.isnan(ratio) else ratio), stage.value
    return worst, worst_stage, share
