"""`RendererPair`: the comparison of two renderers' answers, from the comparison of each with the oracle.

Two renderers agree in a pixel if they differ by no more than both limits, or if neither of them is wrong there.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.measurement import Explained, Kind, StagePixels, held_to, kinds_of, ratios
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.scene_truth import SceneTruth


@dataclass(frozen=True, eq=False)
class RendererPair:
    """A subject and a reference, or any two renderers, in either order."""

    one: AgainstOracle
    other: AgainstOracle

    @property
    def base(self) -> SceneTruth:
        """Return the truth of the scene."""
        return self.one.base

    @property
    def subject(self) -> Answers:
        """Return the first renderer."""
        return self.one.renderer

    @property
    def reference(self) -> Answers:
        """Return the second renderer."""
        return self.other.renderer

    @property
    def by_oracle(self) -> bool:
        """Return whether the second is the oracle."""
        return self.reference.name == ORACLE

    @cached_property
    def _known(self) -> dict[Stage, StagePixels]:
        return {}

    def pixels(self, stage: Stage) -> StagePixels:
        """Return the comparison of an image stage that both answer, the first against the second, pixel by pixel."""
        if stage not in self._known:
            self._known[stage] = self.one.end_to_end[stage] if self.by_oracle else self._compared(stage)
        return self._known[stage]

    def worst(self, stage: Stage) -> tuple[float, int]:
        """Return the worst error over limit without explained pixels, and the number of wrong pixels."""
        if self.by_oracle or stage in self._known:
            pixels = self.pixels(stage)
        else:
            ratio = self._measured(stage)[2]
            if (ratio <= 1).all():
                return float(ratio.max()), 0
            pixels = self.pixels(stage)
        return float(np.where(pixels.explained, 0.0, pixels.ratio).max()), int(np.count_nonzero(pixels.wrong))

    def _measured(self, stage: Stage) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the second renderer's value, the sum of both limits, error over limit, and error."""
        limits = [against.own_limits.end_to_end.get(stage) for against in (self.one, self.other)]
        limit = self.base.no_limit if limits[0] is None or limits[1] is None else limits[0] + limits[1]
        value = np.asarray(self.reference.answers[stage], dtype=np.float64)
        return value, limit, *ratios(stage, self.subject.answers[stage], value, limit)

    def _compared(self, stage: Stage) -> StagePixels:
        base, sides = self.base, (self.one, self.other)
        value, limit, ratio, error = self._measured(stage)
        explained = None
        if not (over := ratio <= 1).all():
            kinds = [against.end_to_end[stage].kinds for against in sides]
            wrong, unknown, epsilon = (
                (kinds[0] == kind) | (kinds[1] == kind) for kind in (Kind.WRONG, Kind.UNEXAMINED, Kind.EPSILON)
            )
            right = ~over & ~wrong
            explained = Explained(
                rounding=right & ~unknown & ~epsilon, epsilon=right & ~unknown & epsilon, unexamined=right & unknown
            )
        size = base.conditioning.distance if stage is Stage.POSITION else None
        kinds = kinds_of(ratio, *held_to(stage, limit, value, size), explained)
        return StagePixels(stage=stage, value=value, limit=limit, ratio=ratio, error=error, kinds=kinds)
