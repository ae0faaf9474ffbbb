"""Epsilons that a renderer declares, held to what rounding needs; what they leave undecided beyond that is counted.

A computed hit lies off its surface, along the normal, by the surface's own error and by the rounding of eye + t d; the
feeler that starts there finds that surface off by as much again as its data are. So much a strategy against acne must
leave unseen. An epsilon that is larger than a few times that is a choice, which costs pixels that nobody can judge.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.answers import Answers, length
from rayproof.reports.judge.checks import Check
from rayproof.reports.judge.comparison import GEOMETRY
from rayproof.reports.judge.conditioning import Conditioning, error_at_eye
from rayproof.reports.judge.limits import HIT, POINT, Roundoff
from rayproof.reports.judge.measurement import Kind, ratios
from rayproof.reports.judge.scene_truth import LIGHT, Terms
from rayproof.reports.judge.surrounded import holes
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


# Whether enough of a case's image could be judged: what a tuned case fixed in advance, and what one check can tell.


# Of a candidate's error of position: what it may leave out before its feelers for rounding's sake.
NEEDED = 8
# A party as if it saw everything.
SEEING = dict.fromkeys(("ray_epsilon", "shadow_epsilon", "light_epsilon", "edge_epsilon", "tie_epsilon"), 0.0)
ALWAYS = (Stage.CAMERA, Stage.RAY)  # decided whatever the scene


def too_little(case: Case, candidate: Answers, terms: Terms) -> list[str]:
    """Return a sentence if fewer pixels could be judged than a tuned case fixed in advance, else nothing."""
    if not case.tuned:
        return []
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    interior, share = _judged(terms, last)
    why = "".join(f"; {note}" for note in terms.classes.notes)
    if interior < case.least_interior:
        return [f"{candidate.name}: {interior} interior pixels, the case asks for {case.least_interior}{why}"]
    if share > case.most_edge:
        return [f"{candidate.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}{why}"]
    if not interior and np.any(terms.conditioning.hit):
        return [f"{candidate.name}: no pixel that hits something lies clear of every edge"]
    return []


def with_too_little_seen(case: Case, checks: Sequence[Check], terms: Terms) -> tuple[list[Check], list[str]]:
    """Return a candidate's checks, and the sentence of `too_little`, if any.

    Not where it is by what the candidate declares not to see. That costs the stages of which too little is left: their
    checks that passed are `undecided`, and the others judge the case. Whether rounding needs what it declares is asked
    elsewhere (`declared_epsilons`).
    """
    candidate = terms.candidate
    why = too_little(case, candidate, terms)
    if not why:
        return list(checks), []
    seeing = replace(candidate, **SEEING)
    if too_little(case, seeing, replace(terms, candidate=seeing)):
        return list(checks), why

    def blind(check: Check) -> bool:
        if check.outcome is not Outcome.PASS or check.stage in ALWAYS:
            return False
        interior, share = _judged(terms, check.stage)
        return interior < max(case.least_interior, 1) or share > case.most_edge

    reason = f"{why[0]}; {candidate.name} declares that it does not see there"
    return [replace(one, outcome=Outcome.UNDECIDED, reason=reason) if blind(one) else one for one in checks], []


def with_enough_to_tell(case: Case, check: Check, terms: Terms) -> Check:
    """Return the check; one that passed is `undecided` where so little could be judged strictly that it says nothing.

    An edge pixel with the reference's own value needed no excuse, and tells as much as one that is judged strictly;
    but not where that value is one of a tie, which both may have by chance. If that is by what a candidate declares
    not to see, far beyond what rounding needs, it is an error: nobody chooses what is decidable of him. If it is by
    what the reference declares, the reference abstains.
    """
    if check.outcome is not Outcome.PASS or check.stage in ALWAYS:
        return check
    why = _nothing_to_tell(case, terms, check.stage)
    excusing = None if why is None else terms.near | terms.classes.tied(check.stage) | ~_agreeing(terms, check.stage)
    if why is None or _nothing_to_tell(case, terms, check.stage, excusing=excusing) is None:
        return check
    candidate = terms.candidate
    blind = np.any(np.asarray(candidate.shadow_epsilon) > 0) or candidate.ray_epsilon > 0
    if blind and not case.tuned:
        needed = NEEDED * terms.limits.position
        honest = replace(
            candidate, ray_epsilon=0.0, shadow_epsilon=np.minimum(np.asarray(candidate.shadow_epsilon), needed)
        )
        if _nothing_to_tell(case, replace(terms, candidate=honest), check.stage) is None:
            reason = f"{why}, for {candidate.name} declares that it does not see there"
            return replace(check, outcome=Outcome.ERROR, reason=reason)
    seeing = replace(terms.witness, **SEEING)
    if _nothing_to_tell(case, replace(terms, witness=seeing), check.stage) is None:
        reason = f"{why}, for {terms.witness.name} declares that it does not see there"
        return replace(check, outcome=Outcome.UNDECIDED, reason=reason, abstains=True)
    return replace(check, outcome=Outcome.UNDECIDED, reason=why)


def _agreeing(terms: Terms, stage: Stage) -> np.ndarray:
    """Return the pixels (height, width) in which both parties have one value, to within the limit away from edges."""
    theirs = np.asarray(terms.witness.answers[stage], dtype=np.float64)
    limit = terms.limits.end_to_end.get(stage, np.zeros(theirs.shape[:2]))
    return ratios(stage, terms.candidate.answers[stage], theirs, limit)[0] <= 1


def _nothing_to_tell(case: Case, terms: Terms, stage: Stage, *, excusing: np.ndarray | None = None) -> str | None:
    """Return why a check of a stage says nothing, or None. Where nothing is hit, misses tell.

    `excusing` are the pixels (height, width) of which an edge excuses anything; without it, all.
    """
    interior, share = _judged(terms, stage, excusing)
    if not interior and np.any(terms.conditioning.hit):
        return "no pixel that hits something lies clear of every edge"
    if share > case.most_edge:
        return f"{share:.4f} of the pixels are edge, and more than {case.most_edge} tell nothing"
    return None


def _judged(terms: Terms, stage: Stage, excusing: np.ndarray | None = None) -> tuple[int, float]:
    """Return how many pixels that hit something are judged strictly at a stage, and the share of edge pixels.

    Of edge pixels only those that are `excusing` count as such.
    """
    # What a renderer says that it does not see before the eye is excused as an edge is, and counts as one.
    edge = terms.classes.edge(stage) | terms.near
    edge = edge if excusing is None else edge & excusing
    return int(np.count_nonzero(terms.conditioning.hit & ~edge)), float(np.count_nonzero(edge) / edge.size)


def mostly_edges(case: Case, terms: Terms) -> bool:
    """Say whether outlines reach more pixels than the case allows: what a side is, such pixels cannot tell.

    By the scene's own conditioning alone, so that no renderer under test can bring it about.
    """
    return float(np.mean(terms.classes.outline)) > case.most_edge


def only_at_edges(check: Check, checks: Sequence[Check], terms: Terms) -> bool:
    """Say whether a failed check has nothing against it but edge pixels with the value of neither side.

    No such pixel is a hole in a mesh, which rounding never opens. Of a stage of light also that each such pixel shows a
    surface, or the back of one, of neither side, as the same two's `checks` of objects and normals say: its light is
    that surface's, and right if it follows from it.
    """
    measured = [one for one in (check.end_to_end, check.continued) if one is not None]
    # A miss at an edge is infinitely far away; one away from edges is worse than any limit.
    missed = check.stage is Stage.DISTANCE
    if not measured or not all(one.worst_inside <= 1 and not one.nan and (missed or not one.inf) for one in measured):
        return False
    wrong = np.logical_or.reduce([one.kinds == Kind.WRONG for one in measured])
    if check.stage in GEOMETRY:
        return not _holed(terms, check.stage, wrong)
    if check.end_to_end is None or (check.continued is not None and not check.continued.worst_ratio <= 1):
        return False
    left = wrong
    for one in checks:
        about = (one.configuration, one.reference) == (check.configuration, check.reference)
        if about and one.stage in (Stage.OBJECT, Stage.NORMAL) and one.end_to_end is not None:
            left = left & (one.end_to_end.kinds != Kind.WRONG)
    return not left.any() and not _holed(terms, Stage.OBJECT, wrong)


def _holed(terms: Terms, stage: Stage, wrong: np.ndarray) -> bool:
    """Say whether one of the wrong pixels, of those that are judged, is a hole."""
    where = np.zeros_like(terms.classes.outline)
    where[:] = wrong
    return bool(holes(terms, stage, where).any())
