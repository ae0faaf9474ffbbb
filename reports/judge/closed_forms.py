"""A case's expectations in closed form (flux, pixel value, shadow outline, uniform value), judged on one subject.

To add one: a dataclass in `cases/case.py` and here a function `(expectation, scene, answers, slack) -> Finding` under
`@EXPECTATIONS.register("NameOfTheDataclass")`. `slack` is the tracer's own rounding at the pixels in question, relative
to the value; it is added to the expectation's tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.case import Case, Expectation, Flux, PixelValue, ShadowOutline, UniformValue
from rayproof.cases.registry import Registry
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import largest
from rayproof.reports.judge.forward.limits import Roundoff
from rayproof.reports.judge.measurement import jsonable
from rayproof.reports.results.case_records import ExpectationRecord
from rayproof.reports.results.outcomes import Outcome


def closed_forms(case: Case, against: AgainstOracle) -> list[ExpectationRecord]:
    """Judge the case's closed forms on one subject's answers."""
    records, subject = [], against.renderer
    for expectation in case.expectations:
        stage = getattr(expectation, "stage", Stage.VISIBILITY if hasattr(expectation, "form") else Stage.IRRADIANCE)
        if not _needed(expectation, stage) <= set(subject.answers):
            continue  # not every renderer answers every stage
        finding = judge(expectation, case.scene, subject.answers, _slack(against, stage))
        outcome = Outcome.MISSING if not finding.used else Outcome.PASS if finding.ratio <= 1 else Outcome.FAIL
        records.append(
            {
                "configuration": subject.name,
                "kind": type(expectation).__name__,
                "stage": stage.value,
                "verdict": outcome.value,
                "measured": jsonable(finding.measured),
                "expected": jsonable(finding.expected),
                "limit": jsonable(finding.limit),
                "ratio": jsonable(finding.ratio),
                "used": finding.used,
                "because": expectation.because,
            }
        )
    return records


def _needed(expectation: Any, stage: Stage) -> set[Stage]:
    """Return the stages that a closed form reads: pixels are selected by their object, an outline by positions."""
    needed = {stage}
    if hasattr(expectation, "shape"):
        needed.add(Stage.OBJECT)
    if hasattr(expectation, "form"):
        needed.add(Stage.POSITION)
    return needed


def _slack(against: AgainstOracle, stage: Stage) -> float:
    """Return the subject's own rounding relative to the image's typical value: the median of limit over value."""
    if stage is Stage.VISIBILITY:
        return Roundoff(against.renderer.precision)(64)
    value, limit = largest(np.abs(against.base.truth[stage])), against.limits.end_to_end[stage]
    limit = largest(limit) if limit.ndim == 3 else limit
    good = against.base.conditioning.hit & (value > 0) & np.isfinite(value)
    return float(np.median(limit[good] / value[good])) if np.any(good) else 0.0


@dataclass(frozen=True, kw_only=True)
class ClosedFormResult:
    """The measured value, the value of the closed form, their allowed difference, and the number of pixels `used`."""

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


Judge = Callable[[Any, Scene, StageImages, float], ClosedFormResult]
EXPECTATIONS: Registry[Judge] = Registry("expectation", package="rayproof.reports.judge.closed_forms")


def judge(expectation: Expectation, scene: Scene, answers: StageImages, slack: float) -> ClosedFormResult:
    """Judge one expectation on the tracer's answers."""
    return EXPECTATIONS[type(expectation).__name__](expectation, scene, answers, slack)


# A closed form for the flux that falls on a rectangle: irradiance times footprint, summed over its pixels.


@EXPECTATIONS.register("Flux")
def flux(expectation: Flux, scene: Scene, answers: StageImages, slack: float) -> ClosedFormResult:
    """Compare the sum over the pixels that show the rectangle."""
    objects = answers[Stage.OBJECT]
    visible = objects[..., 0] == expectation.shape
    if expectation.face >= 0:
        visible &= objects[..., 1] == expectation.face
    total = float(np.sum(answers[Stage.IRRADIANCE][visible][:, expectation.channel])) * expectation.footprint
    return ClosedFormResult(
        measured=total,
        expected=expectation.value,
        limit=(expectation.relative + slack) * abs(expectation.value),
        used=int(np.count_nonzero(visible)),
    )


# A closed form at one pixel.


@EXPECTATIONS.register("PixelValue")
def pixel_value(expectation: PixelValue, scene: Scene, answers: StageImages, slack: float) -> ClosedFormResult:
    """Compare one channel of one pixel."""
    image = answers[expectation.stage]
    return ClosedFormResult(
        measured=float(image[expectation.row, expectation.column, expectation.channel]),
        expected=expectation.value,
        limit=(expectation.relative + slack) * abs(expectation.value),
        used=1,
    )


# A closed form for a shadow's outline: dark inside, lit outside, without a test in the margin about the outline.


@EXPECTATIONS.register("ShadowOutline")
def shadow_outline(expectation: ShadowOutline, scene: Scene, answers: StageImages, slack: float) -> ClosedFormResult:
    """Count the pixels on the wrong side of the outline; none may be."""
    visible = answers[Stage.OBJECT][..., 0] == expectation.shape
    offset = np.abs(answers[Stage.POSITION][..., :2] - np.asarray(expectation.center))
    if expectation.form == "square":
        beyond = offset.max(axis=-1) - expectation.size
    elif expectation.form == "disc":
        beyond = np.hypot(offset[..., 0], offset[..., 1]) - expectation.size
    else:
        raise ValueError(f"a shadow outline is a square or a disc, not {expectation.form!r}")
    margin = expectation.margin + slack * expectation.size
    lit = answers[Stage.VISIBILITY][..., expectation.light]
    inside, outside = visible & (beyond < -margin), visible & (beyond > margin)
    wrong = np.count_nonzero(inside & (lit != 0)) + np.count_nonzero(outside & (lit != 1))
    # Without pixels on both sides there is no outline.
    used = int(np.count_nonzero(inside | outside)) if np.any(inside) and np.any(outside) else 0
    return ClosedFormResult(measured=float(wrong), expected=0.0, limit=0.0, used=used)


# A closed form at every pixel of a shape: the pixel with the largest error counts.


@EXPECTATIONS.register("UniformValue")
def uniform_value(expectation: UniformValue, scene: Scene, answers: StageImages, slack: float) -> ClosedFormResult:
    """Compare the worst pixel of the shape."""
    visible = answers[Stage.OBJECT][..., 0] == expectation.shape
    values = answers[expectation.stage][visible][:, expectation.channel]
    limit = (expectation.relative + slack) * abs(expectation.value)
    if not len(values):
        return ClosedFormResult(measured=float("nan"), expected=expectation.value, limit=limit, used=0)
    off = np.nan_to_num(np.abs(values - expectation.value), nan=np.inf)
    return ClosedFormResult(
        measured=float(values[off.argmax()]), expected=expectation.value, limit=limit, used=len(values)
    )
