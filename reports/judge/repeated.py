"""Whether a renderer that is asked twice gives the same image, and which pixels change.

Pixels that change from call to call come of a race between threads, of memory that nobody has written, or of a seed
that is drawn anew. What is judged of such images is true of one of them. A program repeats if two of its images differ
by no more than two right renderers may, or than a millionth of the image's largest value. It may promise to repeat to
the last bit (`"deterministic": true`), as the tracer and the references must.
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


NOTHING = 1e-6  # of the largest light of an image: what several threads change that add it up in another order


def changes(first: StageImages, again: StageImages) -> dict[Stage, np.ndarray]:
    """Return which pixels (height, width) differ in any bit, for each stage that does; whole stages are one pixel."""
    found = {}
    for stage in Stage:
        if stage not in first and stage not in again:
            continue
        one, other = first.get(stage), again.get(stage)
        if stage is Stage.CAMERA or one is None or other is None or np.shape(one) != np.shape(other):
            differ = np.full((1, 1), not _same_matrices(one, other))
        else:
            differ = np.any(_bits_differ(np.asarray(one), np.asarray(other)), axis=-1)
        if differ.any():
            found[stage] = differ
    return found


def _bits_differ(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return where two arrays of numbers differ, a zero's sign included; one NaN is as good as another."""
    either = (one == other) & (np.signbit(one) == np.signbit(other))
    return ~(either | (np.isnan(one) & np.isnan(other)))


def _same_matrices(one: Any, other: Any) -> bool:
    if not isinstance(one, Mapping) or not isinstance(other, Mapping) or one.keys() != other.keys():
        return False
    return all(np.array_equal(one[part], other[part], equal_nan=True) for part in one)


def repeated(case: str, first: Answers, again: Answers, base: "SceneTruth | None", *, varies: bool) -> RepeatedRecord:
    """Return what came of asking a subject again; `varies` says that its images may differ within the limits.

    `base` is what the case was judged on; without one nothing is said of how far two answers differ.
    """
    found: RepeatedRecord = {"configuration": first.name, "stage": None, "pixel": None, "differing": 0, "beyond": 0.0}
    if first.error is not None:  # its case is an error already
        return {**found, "verdict": Outcome.UNDECIDED.value, "sentence": ""}
    if again.error is not None:
        sentence = f"{first.name} was put to {case} twice, and the second time it ended in an error: {again.error}"
        return {**found, "verdict": Outcome.FAIL.value, "sentence": sentence}
    differ = changes(first.answers, again.answers)
    if not differ:
        return {**found, "verdict": Outcome.PASS.value, "sentence": ""}
    stage, where = next(iter(differ.items()))
    row, column = (int(place) for place in np.argwhere(where)[0])
    beyond, worst, share = _beyond(first, again, base)
    found |= {
        "stage": stage.value,
        "pixel": [column, row],
        "differing": int(np.count_nonzero(where)),
        "beyond": jsonable(float(f"{beyond:.4g}")),
    }
    if varies and base is not None and beyond <= 1:
        sentence = (
            f"It repeats to {share:.2g} of the largest value: {found['differing']} of {where.size} pixels differ."
        )
        return {**found, "verdict": Outcome.PASS.value, "sentence": sentence}
    sentence = (
        f"{first.name} answers {case} differently when it is asked again: {found['differing']} of {where.size} pixels "
        f"of {stage} differ, the first at ({column}, {row})"
        + ("" if beyond <= 1 else f", {worst} by {beyond:.3g} times the limit")
    )
    return {**found, "verdict": Outcome.FAIL.value, "sentence": sentence}


def add_note(record: CaseRecord, repeated: RepeatedRecord, subject: str) -> None:
    """Add to a case's notes how far its image repeats, if that is not to the last bit and within the limits."""
    if repeated["verdict"] == Outcome.PASS and repeated["sentence"]:
        record["notes"] = [*record.get("notes", []), {"reference": subject, "note": repeated["sentence"]}]


def _beyond(first: Answers, again: Answers, base: "SceneTruth | None") -> tuple[float, str, float]:
    """Return the largest difference of two answers over what two right ones may differ by, and at which stage.

    The last number is the largest difference as a share of its stage's largest value.
    """
    mine, theirs = first.answers, again.answers
    if mine.keys() != theirs.keys():
        return np.inf, "the stages that it writes", np.inf
    if base is None:
        return 0.0, "", 0.0
    worst, said, share = 0.0, "", 0.0
    # Where images differ, and with them much of the judge.
    from rayproof.reports.judge.against_oracle import AgainstOracle
    from rayproof.reports.judge.pairs import RendererPair

    pair = RendererPair(
        AgainstOracle(base, first), AgainstOracle(base, replace(again, name=f"{first.name}, asked again"))
    )
    for stage in IMAGE_STAGES:
        if stage not in mine:
            continue
        if np.shape(mine[stage]) != np.shape(base.truth[stage]) or np.shape(mine[stage]) != np.shape(theirs[stage]):
            return np.inf, stage.value, np.inf
        pixels = pair.pixels(stage)
        with np.errstate(invalid="ignore", divide="ignore"):  # of images with infinite and with no values
            apart = np.nan_to_num(np.abs(mine[stage] - theirs[stage]), nan=0.0).max(axis=-1)
            apart = apart / np.nan_to_num(np.abs(base.truth[stage]), nan=0.0, posinf=0.0).max(initial=0.0)
        share = max(share, float(np.nan_to_num(apart).max(initial=0.0)))
        nothing = (apart <= NOTHING) & (stage in LIGHT) & np.isfinite(mine[stage]).all(axis=-1)
        ratio = float(np.where(pixels.explained | nothing, 0.0, pixels.ratio).max())
        if not ratio <= worst:
            worst, said = (np.inf if np.isnan(ratio) else ratio), stage.value
    return worst, said, share
