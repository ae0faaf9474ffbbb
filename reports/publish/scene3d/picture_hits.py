"""Which hits of a case are drawn, and how far off each is: what the picture and the 3-D view have in common."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.stages import FACTS, Stage

MOST_POINTS, WORST_KEPT = 1000, 20
# What is coloured unless the case blames a stage of its own.
COLORED = (Stage.DISTANCE, Stage.POSITION, Stage.RADIANCE)


@dataclass(frozen=True, kw_only=True)
class Hits:
    """Hit points and the pixels that they belong to."""

    rows: np.ndarray  # (n,)
    columns: np.ndarray  # (n,)
    points: np.ndarray  # (n, 3) m
    normals: np.ndarray  # (n, 3)

    def of(self, image: np.ndarray) -> np.ndarray:
        """Return the values of an image (height, width, ...) at these pixels."""
        return image[self.rows, self.columns]


def chosen_hits(ours: Any, theirs: Any, error: np.ndarray | None) -> Hits | None:
    """Return at most about `MOST_POINTS` hits of ours (else theirs), the worst by `error` among them; None without."""
    answers = ours or theirs or {}
    if Stage.POSITION not in answers or Stage.OBJECT not in answers:
        return None
    positions = answers[Stage.POSITION]
    hit = (answers[Stage.OBJECT][..., 0] >= 0) & np.isfinite(positions).all(axis=-1)
    rows, columns = np.nonzero(hit)
    if not len(rows):
        return None
    chosen = np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(int)
    if error is not None:
        # The worst pixels are what one looks for; thinning must not lose them.
        chosen = np.unique(np.concatenate([chosen, np.argsort(error[rows, columns])[-WORST_KEPT:]]))
    rows, columns = rows[chosen], columns[chosen]
    normals = answers.get(Stage.NORMAL, np.zeros_like(positions))[rows, columns]
    return Hits(
        rows=rows, columns=columns, points=positions[rows, columns].astype(np.float64), normals=normals.astype(float)
    )


def colored_stage(ours: Any, theirs: Any, blamed: str | None) -> Stage | None:
    """Return the stage whose errors are drawn: the blamed one, else the first that both answered; None without."""
    wanted = [Stage(blamed)] if blamed in set(Stage) else []
    return next((stage for stage in (*wanted, *COLORED) if comparable(ours, theirs, stage)), None)


def comparable(ours: Any, theirs: Any, stage: Stage) -> bool:
    """Return whether both answered a stage in the same shape."""
    return bool(ours and theirs and stage in ours and stage in theirs and ours[stage].shape == theirs[stage].shape)


def absolute_error(ours: Any, theirs: Any, stage: Stage) -> np.ndarray:
    """Return the largest absolute difference over channels (height, width); NaN and infinities stay what they are."""
    a, b = ours[stage].astype(np.float64), theirs[stage].astype(np.float64)
    with np.errstate(invalid="ignore"):
        return np.where(a == b, 0.0, np.abs(a - b)).max(axis=-1)


def correct_digits(ours: Any, theirs: Any, stage: Stage) -> np.ndarray:
    """Return -log10 of the error relative to the reference's largest channel (height, width); inf where exact."""
    error = absolute_error(ours, theirs, stage)
    size = np.abs(theirs[stage].astype(np.float64)).max(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(error == 0, np.inf, -np.log10(error / size))


def title_of(stage: Stage) -> str:
    """Return what a colour bar says of a stage's errors."""
    unit = FACTS[stage].unit
    return f"log10 |{stage} error|" + (f" [{unit}]" if unit != "1" else "")
