"""The numbers behind a view's points: which pixel each belongs to, and how far off it is at every stage."""

from typing import Any, TypedDict

import numpy as np

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.publish.scene3d.picture_hits import Hits, absolute_error, comparable, correct_digits

# Hundredths of a decade tell any two colours apart, and small whole numbers compress.
HUNDREDTHS = 100
STAGES = tuple(stage for stage in Stage if stage not in (Stage.CAMERA, Stage.OBJECT))


class StageValues(TypedDict):
    """How far off the points are at a stage, in hundredths of a decade."""

    unit: str
    error: list[int | str | None]
    digits: list[int | str | None]


class PointValues(TypedDict):
    """The points' pixels [column, row], and their values by stage."""

    pixels: list[list[int]]
    stages: dict[str, StageValues]


def point_values(hits: Hits, ours: Any, theirs: Any) -> PointValues:
    """Return `pixels` [[column, row], ...] and per comparable stage `error` and `digits`, hundredths of a decade.

    `error` is log10 of the largest absolute difference over channels, `digits` -log10 of the relative one; null where
    exact, "nan" where the difference is no finite number.
    """
    with np.errstate(divide="ignore"):
        stages: dict[str, StageValues] = {
            stage.value: {
                "unit": FACTS[stage].unit,
                "error": _hundredths(np.log10(hits.of(absolute_error(ours, theirs, stage))), exact=-np.inf),
                "digits": _hundredths(hits.of(correct_digits(ours, theirs, stage)), exact=np.inf),
            }
            for stage in STAGES
            if comparable(ours, theirs, stage)
        }
    return {"pixels": np.stack([hits.columns, hits.rows], axis=1).tolist(), "stages": stages}


def _hundredths(values: np.ndarray, *, exact: float) -> list[int | str | None]:
    known = np.isfinite(values)
    rounded: list[int | str | None] = np.rint(HUNDREDTHS * np.where(known, values, 0)).astype(int).tolist()
    for place in np.flatnonzero(~known).tolist():
        rounded[place] = None if values[place] == exact else "nan"
    return rounded
