"""Epsilons that a renderer declares, against what rounding needs; checks with too few pixels that tell anything.

A computed hit lies off its surface, along the normal, by the surface's own error and by the rounding of eye + t d; the
feeler that starts there finds that surface off by as much again as its data are. So much a strategy against acne must
leave unseen. An epsilon that is larger than a few times that is a choice, which costs pixels that nobody can judge.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.answers import Answers, length
from rayproof.reports.judge.comparison import GEOMETRY, LIGHT, Comparison
from rayproof.reports.judge.conditioning import Conditioning, error_at_eye
from rayproof.reports.judge.limits import HIT, POINT, Roundoff
from rayproof.reports.judge.measurement import Kind, ratios
from rayproof.reports.judge.mesh_holes import holes
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome

# How many times what rounding needs an epsilon may be: a bound is a few times what it bounds, taken for a whole scene
# it is a few times more, and a strategy may double it at either end.
ALLOWED = 16
LIT = (Stage.VISIBILITY, *LIGHT)
# What is no worse than that too little could be judged: where that is by the subject's own choice it fails.
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


def excess(pair: Comparison) -> Excess:
    """Return what the subject's epsilons leave undecided beyond what rounding needs in the precision judged."""
    subject, scene, c = pair.subject, pair.scene, pair.conditioning
    g = Roundoff(subject.precision)
    shadow = near = np.zeros(c.hit.shape, dtype=bool)
    if scene.lights and np.any(subject.shadow_epsilon):
        allowed = ALLOWED * needed_shadow(c, scene, pair.truth[Stage.POSITION], g)
        if np.any(c.hit & (subject.shadow_epsilon > allowed)):
            shadow = pair.undecided_beyond(np.minimum(subject.shadow_epsilon, allowed))
    most = ALLOWED * needed_ray(scene, g)
    if subject.ray_epsilon > most:
        near = pair.near & (c.distance > most)
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
        return structs.replace(check, outcome=Outcome.FAIL, reason=f"{why}; the case allows a share of {most_edge:.3g}")
    if count and check.outcome is Outcome.PASS:
        return structs.replace(check, outcome=Outcome.WARN, reason=why)
    return check


# Whether enough of a case's image could be judged: what a tuned case fixed in advance, and what one check can tell.


# Of a subject's error of position: what it may leave out before its feelers for rounding's sake.
NEEDED = 8
# A renderer as if it saw everything.
SEEING = dict.fromkeys(("ray_epsilon", "shadow_epsilon", "light_epsilon", "edge_epsilon", "tie_epsilon"), 0.0)
ALWAYS = (Stage.CAMERA, Stage.RAY)  # decided whatever the scene


def too_little(case: Case, subject: Answers, pair: Comparison) -> list[str]:
    """Return a sentence if fewer pixels could be judged than a tuned case fixed in advance, else nothing."""
    if not case.tuned:
        return []
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    interior, share = _judged(pair, last)
    why = "".join(f"; {note}" for note in pair.classes.notes)
    if interior < case.least_interior:
        return [f"{subject.name}: {interior} interior pixels, the case asks for {case.least_interior}{why}"]
    if share > case.most_edge:
        return [f"{subject.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}{why}"]
    if not interior and np.any(pair.conditioning.hit):
        return [f"{subject.name}: no pixel that hits something lies clear of every edge"]
    return []


def with_too_little_seen(case: Case, checks: Sequence[Check], pair: Comparison) -> tuple[list[Check], list[str]]:
    """Return a subject's checks, and the sentence of `too_little`, if any.

    Not where it is by what the subject declares not to see. That costs the stages of which too little is left: their
    checks that passed are `undecided`, and the others judge the case. Whether rounding needs what it declares is asked
    elsewhere (`declared_epsilons`).
    """
    subject = pair.subject
    why = too_little(case, subject, pair)
    if not why:
        return list(checks), []
    seeing = replace(subject, **SEEING)
    if too_little(case, seeing, replace(pair, subject=seeing)):
        return list(checks), why

    def blind(check: Check) -> bool:
        if check.outcome is not Outcome.PASS or check.stage in ALWAYS:
            return False
        interior, share = _judged(pair, check.stage)
        return interior < max(case.least_interior, 1) or share > case.most_edge

    reason = f"{why[0]}; {subject.name} declares that it does not see there"
    return [structs.replace(one, outcome=Outcome.UNDECIDED, reason=reason) if blind(one) else one for one in checks], []


def with_enough_to_tell(case: Case, check: Check, pair: Comparison) -> Check:
    """Return the check; one that passed is `undecided` where so little could be judged strictly that it says nothing.

    An edge pixel with the reference's own value needed no excuse, and tells as much as one that is judged strictly;
    but not where that value is one of a tie, which both may have by chance. If that is by what a subject declares
    not to see, far beyond what rounding needs, it is an error: nobody chooses what is decidable of him. If it is by
    what the reference declares, the reference abstains.
    """
    if check.outcome is not Outcome.PASS or check.stage in ALWAYS:
        return check
    why = _nothing_to_tell(case, pair, check.stage)
    excusing = None if why is None else pair.near | pair.classes.tied(check.stage) | ~_agreeing(pair, check.stage)
    if why is None or _nothing_to_tell(case, pair, check.stage, excusing=excusing) is None:
        return check
    subject = pair.subject
    blind = np.any(np.asarray(subject.shadow_epsilon) > 0) or subject.ray_epsilon > 0
    if blind and not case.tuned:
        needed = NEEDED * pair.limits.position
        honest = replace(
            subject, ray_epsilon=0.0, shadow_epsilon=np.minimum(np.asarray(subject.shadow_epsilon), needed)
        )
        if _nothing_to_tell(case, replace(pair, subject=honest), check.stage) is None:
            reason = f"{why}, for {subject.name} declares that it does not see there"
            return structs.replace(check, outcome=Outcome.ERROR, reason=reason)
    seeing = replace(pair.reference, **SEEING)
    if _nothing_to_tell(case, replace(pair, reference=seeing), check.stage) is None:
        reason = f"{why}, for {pair.reference.name} declares that it does not see there"
        return structs.replace(check, outcome=Outcome.UNDECIDED, reason=reason, abstains=True)
    return structs.replace(check, outcome=Outcome.UNDECIDED, reason=why)


def _agreeing(pair: Comparison, stage: Stage) -> np.ndarray:
    """Return the pixels (height, width) in which both renderers have one value, to within the limit away from edges."""
    theirs = np.asarray(pair.reference.answers[stage], dtype=np.float64)
    limit = pair.limits.end_to_end.get(stage, np.zeros(theirs.shape[:2]))
    return ratios(stage, pair.subject.answers[stage], theirs, limit)[0] <= 1


def _nothing_to_tell(case: Case, pair: Comparison, stage: Stage, *, excusing: np.ndarray | None = None) -> str | None:
    """Return why a check of a stage says nothing, or None. Where nothing is hit, misses tell.

    `excusing` are the pixels (height, width) of which an edge excuses anything; without it, all.
    """
    interior, share = _judged(pair, stage, excusing)
    if not interior and np.any(pair.conditioning.hit):
        return "no pixel that hits something lies clear of every edge"
    if share > case.most_edge:
        return f"{share:.4f} of the pixels are edge, and more than {case.most_edge} tell nothing"
    return None


def _judged(pair: Comparison, stage: Stage, excusing: np.ndarray | None = None) -> tuple[int, float]:
    """Return how many pixels that hit something are judged strictly at a stage, and the share of edge pixels.

    Of edge pixels only those that are `excusing` count as such.
    """
    # What a renderer says that it does not see before the eye is excused as an edge is, and counts as one.
    edge = pair.classes.edge(stage) | pair.near
    edge = edge if excusing is None else edge & excusing
    return int(np.count_nonzero(pair.conditioning.hit & ~edge)), float(np.count_nonzero(edge) / edge.size)


def mostly_edges(case: Case, pair: Comparison) -> bool:
    """Say whether outlines reach more pixels than the case allows: what a side is, such pixels cannot tell.

    By the scene's own conditioning alone, so that no renderer under test can bring it about.
    """
    return float(np.mean(pair.classes.outline)) > case.most_edge


def only_at_edges(check: Check, checks: Sequence[Check], pair: Comparison) -> bool:
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
        return not _holed(pair, check.stage, wrong)
    if check.end_to_end is None or (check.continued is not None and not check.continued.worst_ratio <= 1):
        return False
    left = wrong
    for one in checks:
        about = (one.configuration, one.reference) == (check.configuration, check.reference)
        if about and one.stage in (Stage.OBJECT, Stage.NORMAL) and one.end_to_end is not None:
            left = left & (one.end_to_end.kinds != Kind.WRONG)
    return not left.any() and not _holed(pair, Stage.OBJECT, wrong)


def _holed(pair: Comparison, stage: Stage, wrong: np.ndarray) -> bool:
    """Say whether one of the wrong pixels, of those that are judged, is a hole."""
    where = np.zeros_like(pair.classes.outline)
    where[:] = wrong
    return bool(holes(pair, stage, where).any())
