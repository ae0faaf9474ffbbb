"""Whether a renderer that is asked twice gives the same image, to the last bit, and which pixels change.

Pixels that change from call to call come of a race between threads, of memory that nobody has written, or of a seed
that is drawn anew. What is judged of such images is true of one of them. A renderer may declare that its answers vary
(`"deterministic": false`); then two of them may differ by as much as two right renderers may.
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
    """Return what came of asking a subject again; `varies` says that it declares to answer otherwise each time.

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
    beyond, worst = _beyond(first, again, base)
    found |= {
        "stage": stage.value,
        "pixel": [column, row],
        "differing": int(np.count_nonzero(where)),
        "beyond": jsonable(float(f"{beyond:.4g}")),
    }
    if varies and beyond <= 1:
        return {**found, "verdict": Outcome.PASS.value, "sentence": ""}
    if varies:
        sentence = (
            f"{first.name} declares that its answers vary, and two to {case} differ by more than right ones may: "
            f"{worst} by {beyond:.3g} times the limit"
        )
        return {**found, "verdict": Outcome.FAIL.value, "sentence": sentence}
    sentence = (
        f"{first.name} answers {case} differently when it is asked again: {found['differing']} of {where.size} pixels "
        f"of {stage} differ, the first at ({column}, {row})" + ("" if beyond <= 1 else f", {worst} beyond the limits")
    )
    return {**found, "verdict": Outcome.FAIL.value, "sentence": sentence}


def _beyond(first: Answers, again: Answers, base: "SceneTruth | None") -> tuple[float, str]:
    """Return the largest difference of two answers over what two right ones may differ by, and at which stage."""
    mine, theirs = first.answers, again.answers
    if mine.keys() != theirs.keys():
        return np.inf, "the stages that it writes"
    if base is None:
        return 0.0, ""
    worst, said = 0.0, ""
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
            return np.inf, stage.value
        pixels = pair.pixels(stage)
        ratio = float(np.where(pixels.explained, 0.0, pixels.ratio).max())
        if not ratio <= worst:
            worst, said = (np.inf if np.isnan(ratio) else ratio), stage.value
    return worst, said
