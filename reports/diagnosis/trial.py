"""One hypothesis before one case: which pixels agree with it, and which of these tell it from the right answer."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import Way
from rayproof.reports.diagnosis.answering import PRECISION, Answered, Unanswerable, answer, right_answer, unsteady
from rayproof.reports.judge.answers import Candidate, Witness
from rayproof.reports.judge.measurement import ratios
from rayproof.reports.judge.oracle import ORACLE, FullOracle, stages_of
from rayproof.reports.judge.scene_truth import Terms, ground

# Of the pixels that are judged at all this share may be off: rounding decides in places that no edge announces, such as
# a feeler that grazes a face. A wrong hypothesis differs in far more.
ALLOWED = 0.002
NEARLY = 0.15  # of the pixels judged: so many off are worth asking where the changed question's own edges are
AGREE = 0.95  # of the pixels that tell the hypothesis from the right answer so many must be the hypothesis's


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the renderer under test answered in a case, and whether it failed there."""

    case: str
    scene: Scene
    load: Callable[[], StageImages]  # the stages that it wrote, read when they are looked at
    failed: bool
    oracle: FullOracle
    undecided: np.ndarray | None  # (height, width): where the judge itself does not decide; None: asked of it
    _kept: dict = field(default_factory=dict)

    @cached_property
    def ours(self) -> StageImages:
        """Return the stages that the renderer wrote."""
        return self.load()

    @cached_property
    def right(self) -> Answered:
        """Return the right answer; what the judge leaves undecided counts as its edges."""
        found = right_answer(self.scene, self.oracle)
        return replace(found, edge=found.edge | self.never)

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Return the stages that the renderer wrote, of the right shape, those that tell most first."""
        known = {
            stage
            for stage in IMAGE_STAGES
            if stage in self.ours
            and stage in self.right.answers
            and np.shape(self.ours[stage]) == np.shape(self.right.answers[stage])
        }
        return tuple(stage for stage in reversed(IMAGE_STAGES) if stage in known)

    @cached_property
    def never(self) -> np.ndarray:
        """Return the pixels (height, width) that the judge itself does not decide."""
        size = (self.scene.camera.height, self.scene.camera.width)
        if self.undecided is not None and self.undecided.shape == size:
            return self.undecided
        return undecided(self.scene, self.oracle, shadow_epsilon=0.0)

    @cached_property
    def wrong(self) -> np.ndarray:
        """Return the pixels (height, width) away from edges at which a stage is not right."""
        return deviates(self.right, {stage: self.ours[stage] for stage in self.stages}) & ~self.right.edge

    @cached_property
    def first_wrong(self) -> Stage | None:
        """Return the first stage that is wrong in more pixels than may be, or None."""
        for stage in reversed(self.stages):
            off = deviates(self.right, {stage: self.ours[stage]}) & ~self.right.edge
            if np.count_nonzero(off) > ALLOWED * off.size:
                return stage
        return None

    def unsure(self, way: Way) -> np.ndarray:
        """Return the pixels (height, width) of which rounding decides under a way, once."""
        key = "unsure", id(way)
        if key not in self._kept:
            supposed = self.under(way)
            try:
                if way.asked is None:
                    found = unsteady(way, self.right, self.oracle)
                else:
                    found = undecided(supposed.scene, self.oracle, shadow_epsilon=0.0)
            except Unanswerable:  # beyond one of the tracer's precisions, of which then nothing can be said
                found = np.zeros(supposed.edge.shape, dtype=bool)
            self._kept[key] = way, found
        return self._kept[key][1]

    def forget(self, way: Way) -> None:
        """Drop what a way answers, which is contradicted."""
        for key in (id(way), ("unsure", id(way))):
            self._kept.pop(key, None)

    def under(self, way: Way) -> Answered:
        """Return what a way answers, once; raise Unanswerable where it has no answer."""
        if way.shading is not None and way.shading != self.scene.shading:
            return self.right
        if id(way) not in self._kept:  # the way is held with its answer, so that no other takes its identity
            try:
                self._kept[id(way)] = way, answer(way, self.right, self.oracle, ours=self.ours)
            except Unanswerable as wrong:
                self._kept[id(way)] = way, wrong
        found = self._kept[id(way)][1]
        if isinstance(found, Unanswerable):
            raise found
        return found


@dataclass(frozen=True, kw_only=True)
class Tally:
    """What became of a case's pixels under a hypothesis."""

    judged: int
    off: int  # neither the hypothesis's value nor next to an edge
    telling: int  # the hypothesis and the right answer differ by more than both may be off
    agree: int  # of these: the renderer has the hypothesis's value

    @property
    def fits(self) -> bool:
        """Say whether the case does not contradict the hypothesis."""
        return self.off <= ALLOWED * self.judged and self.agree >= AGREE * self.telling

    @property
    def explains(self) -> bool:
        """Say whether the hypothesis answers as the renderer does where that is not the right answer."""
        return self.fits and self.agree > 0


def trial(evidence: Evidence, way: Way, stages: Collection[Stage] = IMAGE_STAGES) -> Tally | None:
    """Judge a renderer against a way's answer, at some stages of those that it wrote; None where the way has none."""
    try:
        supposed = evidence.under(way)
    except Unanswerable:
        return None
    seen = [stage for stage in evidence.stages if stage in stages]
    ours = {stage: evidence.ours[stage] for stage in seen}
    right = {stage: evidence.right.answers[stage] for stage in seen}
    judged = ~supposed.edge & ~evidence.never
    found = _tally(evidence, supposed, ours, right, judged)
    # Where the way answers rightly in all of these pixels, what rounding decides is undecided of the right answer, too.
    if not found.fits and found.telling and way.stored is None and found.off <= NEARLY * found.judged:
        # It has edges of its own that no neighbouring pixel shows: coinciding faces, or a border in its first row.
        found = _tally(evidence, supposed, ours, right, judged & ~evidence.unsure(way))
    return found


def _tally(evidence: Evidence, supposed: Answered, ours: StageImages, right: StageImages, judged: np.ndarray) -> Tally:
    """Count what agrees with a supposed answer in the pixels that are judged."""
    off = deviates(supposed, ours) & judged
    telling = judged & ~evidence.right.edge & deviates(supposed, right, times=2)
    return Tally(
        judged=int(np.count_nonzero(judged)),
        off=int(np.count_nonzero(off)),
        telling=int(np.count_nonzero(telling)),
        agree=int(np.count_nonzero(telling & ~off)),
    )


def differ(evidence: Evidence, one: Way, other: Way) -> bool:
    """Say whether a case tells two hypotheses apart in the stages that the renderer writes."""
    try:
        first, second = (evidence.under(way) for way in (one, other))
    except Unanswerable:
        return False
    apart = deviates(first, {stage: second.answers[stage] for stage in evidence.stages}, times=2)
    apart &= ~first.edge & ~second.edge
    return int(np.count_nonzero(apart)) > ALLOWED * apart.size


def deviates(supposed: Answered, ours: StageImages, *, times: float = 1) -> np.ndarray:
    """Return the pixels (height, width) at which some stage is not the supposed one, within so many limits."""
    found = np.zeros(supposed.edge.shape, dtype=bool)
    for stage, image in ours.items():
        value = np.asarray(supposed.answers[stage], dtype=np.float64)
        with np.errstate(all="ignore"):
            ratio, _ = ratios(stage, np.asarray(image, dtype=np.float64), value, supposed.limits[stage])
        found |= ~(ratio <= times)
    return found


def undecided(scene: Scene, oracle: FullOracle, *, shadow_epsilon: float) -> np.ndarray:
    """Return the pixels (height, width) that the judge does not decide for a renderer in float32."""
    truth = oracle.render(scene, stages_of(scene))
    base = ground(scene, stages_of(scene), oracle, known=truth)
    candidate = Candidate(
        name="subject", precision=PRECISION, items=frozenset(), shadow_epsilon=shadow_epsilon, answers=None
    )
    witness = Witness(name=ORACLE, precision="float64", independent=True, shadow_epsilon=0.0, answers=truth)
    classes = Terms(ground=base, candidate=candidate, witness=witness).classes
    return classes.edge(Stage.RADIANCE) if scene.lights else classes.outline
