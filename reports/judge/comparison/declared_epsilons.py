"""Epsilons that a renderer declares, held to what rounding needs; what they leave undecided beyond that is counted.

A computed hit lies off its surface, along the normal, by the surface's own error and by the rounding of eye + t d; the
feeler that starts there finds that surface off by as much again as its data are. So much a strategy against acne must
leave unseen. An epsilon that is larger than a few times that is a choice, which costs pixels that nobody can judge.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.comparison.check import Check
from rayproof.reports.judge.tolerance.channels import length
from rayproof.reports.judge.tolerance.conditioning import Conditioning, error_at_eye
from rayproof.reports.judge.tolerance.limits import HIT, POINT, Roundoff
from rayproof.reports.judge.tolerance.pair_limits import LIGHT, Terms
from rayproof.reports.results.outcomes import Outcome

# How many times what rounding needs an epsilon may be: a bound is a few times what it bounds, taken for a whole scene
# it is a few times more, and a strategy may double it at either end.
ALLOWED = 16
LIT = (Stage.VISIBILITY, *LIGHT)
# What is no worse than that too little could be judged: where that is by the candidate's own choice it fails.
HELD = (Outcome.PASS, Outcome.UNDECIDED, Outcome.ERROR)


def needed_shadow(c: Conditioning, scene: Scene, position: np.ndarray, g: Roundoff) -> np.ndarray:
    """Return how far [m] (height, width) a hit may seem off its own surface, to itself and to the feeler from it."""
    eye = float(np.linalg.norm(scene.camera.eye))
    return g(HIT) * (c.surface + c.point) + g(POINT) * (eye + c.distance + length(position))


def needed_ray(scene: Scene, g: Roundoff) -> float:
    """Return how far [m] a surface through the eye may seem off it."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    return g(HIT) * max((error_at_eye(shape, eye) for shape in scene.shapes), default=0.0)


@dataclass(frozen=True, kw_only=True)
class Excess:
    """The pixels (height, width) that an epsilon leaves undecided only where it is more than `ALLOWED` times needed."""

    shadow: np.ndarray
    near: np.ndarray

    def at(self, stage: Stage) -> np.ndarray:
        """Return those of a stage."""
        if stage not in IMAGE_STAGES or stage is Stage.RAY:
            return np.zeros_like(self.near)
        return self.near | self.shadow if stage in LIT else self.near


def excess(terms: Terms) -> Excess:
    """Return what the candidate's epsilons leave undecided beyond what rounding needs in the precision judged."""
    candidate, scene, c = terms.candidate, terms.scene, terms.conditioning
    g = Roundoff(candidate.precision)
    shadow = near = np.zeros(c.hit.shape, dtype=bool)
    if scene.lights and np.any(candidate.shadow_epsilon):
        allowed = ALLOWED * needed_shadow(c, scene, terms.truth[Stage.POSITION], g)
        if np.any(c.hit & (candidate.shadow_epsilon > allowed)):
            shadow = terms.undecided_beyond(np.minimum(candidate.shadow_epsilon, allowed))
    most = ALLOWED * needed_ray(scene, g)
    if candidate.ray_epsilon > most:
        near = terms.near & (c.distance > most)
    return Excess(shadow=shadow, near=near)


def held_to_epsilons(checks: Sequence[Check], beyond: Mapping[str, Excess], most_edge: float) -> list[Check]:
    """Return the checks: what passed is a warning, and what has too many pixels left undecided so is a failure."""
    return [_held(check, beyond.get(check.configuration), most_edge) for check in checks]


def _held(check: Check, beyond: Excess | None, most_edge: float) -> Check:
    if beyond is None or check.end_to_end is None or check.outcome not in HELD:
        return check
    pixels = beyond.at(check.stage)
    count = int(np.count_nonzero(pixels))
    why = (
        f"{count} of {pixels.size} pixels are left undecided only by the epsilon that {check.configuration} "
        f"declares, which is more than {ALLOWED} times what rounding needs"
    )
    if count > most_edge * pixels.size:
        return replace(check, outcome=Outcome.FAIL, reason=f"{why}; the case allows a share of {most_edge:.3g}")
    if count and check.outcome is Outcome.PASS:
        return replace(check, outcome=Outcome.WARN, reason=why)
    return check
