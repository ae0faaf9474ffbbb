"""Closed forms that a case carries: one file for each kind, judged on the tracer's own images.

To add one: a dataclass in `cases/case.py` and, in a new file here, a function `(expectation, scene, answers, slack) ->
Finding` under `@EXPECTATIONS.register("NameOfTheDataclass")`. `slack` is the tracer's own rounding at the pixels in
question, relative to the value; it is added to the expectation's tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rayproof.cases.case import Expectation
from rayproof.cases.registry import Registry
from rayproof.cases.scene import Scene
from rayproof.cases.stages import StageImages


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What was measured, what the closed form says and how far apart they may be; `used` is how much was looked at."""

    measured: float
    expected: float
    limit: float
    used: int  # pixels; 0 means that nothing was measured

    @property
    def ratio(self) -> float:
        """Return the error over the limit; NaN counts as inf."""
        error = abs(self.measured - self.expected)
        if error == 0:
            return 0.0
        return error / self.limit if self.limit > 0 and error == error else float("inf")


Judge = Callable[[Any, Scene, StageImages, float], Finding]
EXPECTATIONS: Registry[Judge] = Registry("expectation", package="rayproof.reports.judge.comparison.expectations")


def judge(expectation: Expectation, scene: Scene, answers: StageImages, slack: float) -> Finding:
    """Judge one expectation on the tracer's answers."""
    return EXPECTATIONS[type(expectation).__name__](expectation, scene, answers, slack)
