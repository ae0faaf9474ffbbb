"""Promises of a case: the least number of pixels within limits, and the most explained by rounding or an epsilon.

If much of an image is explained by nearby problems, the limits decide too little of it, so each case fixes the largest
share in advance. The tracer's answers must keep the promise; otherwise the case is in error. Any other subject beyond
it is undecided, since it must not fail by pixels that could not be decided.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import structs

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.against_oracle import AgainstOracle, needed_shadow
from rayproof.reports.judge.forward.conditioning import error_at_eye
from rayproof.reports.judge.forward.limits import HIT, Roundoff
from rayproof.reports.judge.measurement import Kind, StagePixels
from rayproof.reports.judge.scene_truth import SceneTruth
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome

ALWAYS = (Stage.CAMERA, Stage.RAY)  # decided in every scene
# The largest allowed epsilon as a multiple of the length that rounding requires: a bound is a few times the error, the
# bound of a whole scene a few times more, and a strategy may double it at either end.
ALLOWED = 16


def held_to_promise(case: Case, check: Check, base: SceneTruth, *, own: bool) -> Check:
    """Return the check; if the promise is broken, a pass becomes undecided, or an error for the tracer (`own`)."""
    if check.outcome is not Outcome.PASS or check.stage in ALWAYS or check.end_to_end is None:
        return check
    measured, hit = check.end_to_end, base.conditioning.hit
    share, within = measured.explained / hit.size, measured.interior
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    reason, unexamined = "", 0 if check.examined is None else check.examined.unexamined
    if unexamined:
        reason = f"{unexamined} of {hit.size} pixels were held to nothing"
    elif share > case.most_explained:
        reason = f"rounding explains {share:.4f} of the pixels, and the case allows {case.most_explained}"
    elif check.stage is last and case.tuned and within < case.least_interior:
        reason = f"{within} pixels that hit something are within their limits, the case asks for {case.least_interior}"
    elif not within and hit.any():
        reason = "no pixel that hits something is within its limit"
    if not reason:
        return check
    return structs.replace(check, outcome=Outcome.ERROR if own else Outcome.UNDECIDED, reason=reason)


# Declared epsilons of a renderer, compared with the length that rounding requires.
#
# The distance of a computed hit from its surface, along the normal, is the surface's own error and the rounding error
# of eye + t d; for the shadow ray that starts there, the error of the surface's data is added once more. A strategy
# against acne must ignore blockers within this length. A larger epsilon, by more than a small factor, is a choice that
# makes pixels undecidable.


def held_to_epsilons(
    checks: Sequence[Check], renderers: Mapping[str, AgainstOracle], most_explained: float
) -> list[Check]:
    """Return the checks: passes become warnings, and checks with too many pixels explained so become failures."""
    return [_held(check, renderers.get(check.configuration), most_explained) for check in checks]


def _held(check: Check, subject: AgainstOracle | None, most_explained: float) -> Check:
    if subject is None or check.end_to_end is None or check.outcome is not Outcome.PASS:
        return check
    if check.stage in ALWAYS or not subject.answers(check.stage):
        return check
    beyond = beyond_need(subject, subject.end_to_end[check.stage])
    count = int(np.count_nonzero(beyond))
    why = (
        f"{count} of {beyond.size} pixels are explained only by the epsilon that {check.configuration} "
        f"declares, which is more than {ALLOWED} times what rounding needs"
    )
    if count > most_explained * beyond.size:
        return structs.replace(
            check, outcome=Outcome.FAIL, reason=f"{why}; the case allows a share of {most_explained:.3g}"
        )
    return structs.replace(check, outcome=Outcome.WARN, reason=why) if count else check


def beyond_need(subject: AgainstOracle, pixels: StagePixels) -> np.ndarray:
    """Return the pixels (height, width) that only an epsilon of more than `ALLOWED` times the required one explains."""
    explained = pixels.kinds == Kind.EPSILON
    if not explained.any():
        return explained
    large = np.asarray(subject.renderer.shadow_epsilon) > ALLOWED * needed_shadow(subject)
    if subject.renderer.ray_epsilon > ALLOWED * needed_ray(subject.base.scene, subject.renderer.precision):
        large = np.ones_like(explained)
    return explained & large


def needed_ray(scene: Scene, precision: str) -> float:
    """Return the largest apparent distance [m] from the eye of a surface that contains it, due to rounding."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    return Roundoff(precision)(HIT) * max((error_at_eye(shape, eye) for shape in scene.shapes), default=0.0)
