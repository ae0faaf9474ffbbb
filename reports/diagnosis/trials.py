"""`Evidence`, `Continued` and `Tally`: one case held against one way of a mistake, by radiance or stage by stage.

By radiance alone, or stage by stage: each as it follows from the renderer's own stages before it.
"""

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, SceneError, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.diagnosis.answering import (
    FLOAT32,
    LEAST,
    LIGHT,
    PRECISION,
    ROUNDING,
    TURNS,
    Answered,
    Unanswerable,
    answer,
    beside,
    between_faces,
    deviates,
    equally_far,
    follows,
    in_their_planes,
    own_limits,
    right_answer,
    seen_from_a_surface,
    traced,
    unsteady,
)
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.forward.limits import Roundoff
from rayproof.reports.judge.measurement import ratios
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.tracer.formulas import FORMULAS

# Of the pixels that are judged at all this share may be off: rounding decides in places that no edge announces, such as
# a feeler that grazes a face. A wrong hypothesis differs in far more.
ALLOWED = 0.002
NEARLY = 0.15  # of the pixels judged: so many off are worth asking where the changed question's own edges are
FEW = 0.02  # of the pixels judged: so many off are worth asking what a way itself meets by rays that rounding turns
MOSTLY = 0.8  # of the pixels that tell: so many that agree are worth it, too
AGREE = 0.95  # of the pixels that tell the hypothesis from the right answer so many must be the hypothesis's


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """The answer of the renderer under test in a case, and whether it failed there."""

    case: str
    scene: Scene
    load: Callable[[], StageImages]  # the stages that it wrote, read when they are looked at
    failed: bool
    oracle: Analytic
    undecided: np.ndarray | None  # (height, width): where the judge itself does not decide; None: asked of it
    rounding: Roundoff = FLOAT32
    _kept: dict = field(default_factory=dict)

    @cached_property
    def ours(self) -> StageImages:
        """Return the stages that the renderer wrote."""
        return self.load()

    @cached_property
    def right(self) -> Answered:
        """Return the right answer; what the judge leaves undecided counts as its edges."""
        found = right_answer(self.scene, self.oracle, self.rounding)
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

    def unsure(self, way: Way) -> np.ndarray:
        """Return the pixels (height, width) of which rounding decides under a way, once."""
        key = "unsure", id(way)
        if key not in self._kept:
            supposed = self.under(way)
            try:
                if way.asked is None:
                    found = unsteady(way, self.right, supposed, self.oracle)
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
    """How many of a case's pixels a hypothesis explains."""

    judged: int
    off: int  # neither the hypothesis's value nor next to an edge
    telling: int  # the hypothesis and the right answer differ by more than both may be off
    agree: int  # of these: the renderer has the hypothesis's value

    @classmethod
    def of(cls, judged: np.ndarray, off: np.ndarray, telling: np.ndarray) -> "Tally":
        """Return the tally of these pixels (height, width)."""
        counts = [int(np.count_nonzero(some)) for some in (judged, off, telling, telling & ~off)]
        return cls(**dict(zip(("judged", "off", "telling", "agree"), counts, strict=True)))

    @property
    def fits(self) -> bool:
        """Say whether the case does not contradict the hypothesis; one pixel, which rounding may decide, never does."""
        return self.off <= ALLOWED * self.judged and self.telling - self.agree <= max(1, (1 - AGREE) * self.telling)

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
    if not found.fits and way.asked is not None and supposed.scene.shapes != evidence.scene.shapes:
        # Shapes that are moved may come to lie in each other or at the eye, however much of the image they fill.
        judged &= ~seen_from_a_surface(supposed.scene, supposed.answers)
        found = _tally(evidence, supposed, ours, right, judged)
    # Where the way answers rightly in all of these pixels, what rounding decides is undecided of the right answer, too;
    # but a wrong formula of hits may lose to rounding what the right one keeps.
    formulas = concerned(way.formulas, evidence.scene, Stage.OBJECT)
    asked = found.telling - found.agree if formulas else found.off if found.telling else found.judged
    if not found.fits and way.stored is None and asked <= NEARLY * found.judged:
        # It has edges of its own that no neighbouring pixel shows: coinciding faces, or a border in its first row.
        found = _tally(evidence, supposed, ours, right, judged & ~evidence.unsure(way))
    return found


def _tally(evidence: Evidence, supposed: Answered, ours: StageImages, right: StageImages, judged: np.ndarray) -> Tally:
    """Count what agrees with a supposed answer in the pixels that are judged."""
    off = deviates(supposed, ours) & judged
    telling = judged & ~evidence.right.edge & deviates(supposed, right, times=2)
    return Tally.of(judged, off, telling)


def differ(evidence: Evidence, one: Way, other: Way) -> bool:
    """Say whether a case tells two hypotheses apart in the stages that the renderer writes."""
    try:
        first, second = (evidence.under(way) for way in (one, other))
    except Unanswerable:
        return False
    apart = deviates(first, {stage: second.answers[stage] for stage in evidence.stages}, times=2)
    apart &= ~first.edge & ~second.edge
    return int(np.count_nonzero(apart)) > ALLOWED * apart.size


def undecided(scene: Scene, oracle: Analytic, *, shadow_epsilon: float) -> np.ndarray:
    """Return the pixels (height, width) that the judge does not decide for a renderer in float32."""
    truth = oracle.render(scene, stages_of(scene))
    base = scene_truth(scene, stages_of(scene), oracle, known=truth)
    subject = Answers(name="subject", precision=PRECISION, shadow_epsilon=shadow_epsilon, answers=truth)
    return AgainstOracle(base, subject).undecided(Stage.RADIANCE if scene.lights else Stage.NORMAL)


# Slots of formulas that meet or light one kind of shapes alone, or one way of asking.
OF_A_KIND = {
    "sphere": Sphere,
    "sphere_normal": Sphere,
    "cube": Cube,
    "cube_normal": Cube,
    "square": Square,
    "plane": Plane,
    "triangle": (Triangle, Mesh),
}
# The stages that formulas of a stage take part in, where these are several: feelers meet shapes as rays do.
HITS = (Stage.OBJECT, Stage.DISTANCE, Stage.VISIBILITY)
PARTS: Mapping[Stage, tuple[Stage, ...]] = {
    Stage.CAMERA: (Stage.RAY,),
    Stage.OBJECT: HITS,
    Stage.DISTANCE: HITS,
}
INTO_OBJECT_SPACE = "to_object"  # the slot of formulas that normals are found by, too
NOTHING: Way = Way()


@dataclass(frozen=True, kw_only=True)
class Continued:
    """A case in which a renderer wrote every stage, each judged as it follows from the others that it wrote."""

    evidence: Evidence
    _kept: dict = field(default_factory=dict)

    @cached_property
    def own(self) -> StageImages:
        """Return the renderer's own stages."""
        return {stage: np.asarray(self.evidence.ours[stage], dtype=np.float64) for stage in self.stages}

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Return the stages, in order."""
        return tuple(stage for stage in IMAGE_STAGES if stage in self.evidence.stages)

    @cached_property
    def usable(self) -> bool:
        """Say whether every stage is there, and the objects are shapes and faces of the scene."""
        if set(self.stages) != set(self.evidence.right.answers) & set(IMAGE_STAGES):
            return False
        shape, face = np.moveaxis(self.own[Stage.OBJECT], -1, 0)
        shapes = self.evidence.scene.shapes
        if not np.all(np.isin(shape, np.arange(-1, len(shapes)))):
            return False
        most = np.array([len(one.faces) if isinstance(one, Mesh) else 1 for one in shapes] + [1])
        return bool(np.all((face < most[shape.astype(int)]) & ((face >= 0) | (shape < 0)) & (face == np.round(face))))

    @cached_property
    def _supposed(self) -> Answered:
        return own_limits(self.evidence.scene, self.own, self.evidence.rounding)

    def scene(self, way: Way) -> Scene:
        """Return the question that a way answers; raise SceneError or ValueError where it is none."""
        if way.asked is None:
            return self.evidence.scene
        key = "scene", id(way)
        if key not in self._kept:
            asked = way.asked(self.evidence.scene)
            self._kept[key] = way, self.evidence.scene if asked == self.evidence.scene else asked
        return self._kept[key][1]

    def value(self, way: Way, stage: Stage) -> np.ndarray | None:
        """Return a stage as a way has it after the renderer's own stages; None where the way has no answer."""
        if way is NOTHING:
            if stage not in self._kept:
                self._kept[stage] = self._value(NOTHING, stage)
            return self._kept[stage]
        try:
            return self._value(way, stage)
        except (Unanswerable, SceneError, ValueError, OverflowError):
            return None

    def _value(self, way: Way, stage: Stage) -> np.ndarray | None:
        if way.shading not in (None, self.evidence.scene.shading):
            way = NOTHING
        scene = self.scene(way)
        formulas = concerned(way.formulas, scene, stage)
        spoilt, changed = stage in way.stages, scene is not self.evidence.scene
        if not spoilt and not changed and not formulas and way is not NOTHING:
            return self.value(NOTHING, stage)
        key = "followed", tuple(sorted(formulas.items())), stage
        with np.errstate(all="ignore"):
            found = None if changed else self._kept.get(key)
            if found is None:
                found = follows(replace(way, formulas=formulas), scene, stage, self.own, self.evidence.oracle)
                if not changed:
                    self._kept[key] = found
            if spoilt:
                turns = (0.0, -ROUNDING, ROUNDING) if stage is Stage.RADIANCE else (0.0,)
                given = [
                    Given(scene=scene, answers=self.own, right=found * (1 + turn), parameter=0.0) for turn in turns
                ]
                found, *ends = (way.stages[stage](one) for one in given)
                if ends:  # where radiance is written in steps, rounding decides which
                    found = np.where(np.abs(ends[1] - ends[0]) > LEAST * np.abs(found), np.nan, found)
        return np.asarray(found, dtype=np.float64)

    def tally(self, way: Way, stage: Stage) -> Tally | None:
        """Return what becomes of the case's pixels at one stage, once; None where there is no answer to it."""
        if stage not in self.stages:
            return None
        key = "tally", id(way), stage  # the way is held with it, so that no other takes its identity
        if key not in self._kept:
            self._kept[key] = way, self._tally_of(way, stage)
        return self._kept[key][1]

    def _tally_of(self, way: Way, stage: Stage) -> Tally | None:
        if way.parts:
            change = [part for part in way.parts if self.changes(part, stage)]
            try:
                other = any(self.scene(part) is not self.evidence.scene for part in way.parts if part not in change)
            except (SceneError, ValueError, OverflowError):
                return None
            if len(change) < len(way.parts) and not other:  # what one of them leaves as it is the other has alone
                return self.tally(change[0] if change else NOTHING, stage)
        value, right = self.value(way, stage), self.value(NOTHING, stage)
        if value is None or right is None:
            return None
        if way is not NOTHING and (value is right or np.array_equal(value, right, equal_nan=True)):
            plain, scene = self.tally(NOTHING, stage), self.scene(way)
            own = scene is not self.evidence.scene or stage in way.stages or concerned(way.formulas, scene, stage)
            if plain is None or plain.fits or not own:
                return plain
        return self._tally(way, stage, value, right)

    def changes(self, way: Way, stage: Stage) -> bool:
        """Say whether a way has an answer of its own to a stage."""
        return self.tally(way, stage) is not self.tally(NOTHING, stage)

    def agreeing(self, way: Way, other: Way, stage: Stage) -> int:
        """Return in how many pixels the renderer has a stage as one way has it, and not as another."""
        value, theirs = self.value(way, stage), self.value(other, stage)
        if value is None or theirs is None or value is theirs:
            return 0
        return self._tally(way, stage, value, theirs).agree

    def _tally(self, way: Way, stage: Stage, value: np.ndarray, other: np.ndarray) -> Tally:
        """Count the pixels that agree with a value, and of these those that tell it from another."""
        judged = ~self.evidence.never & ~np.any(np.isnan(value), axis=-1)
        if stage is Stage.NORMAL:
            judged &= ~between_faces(self.evidence.scene, self.own)
        limit = self._supposed.limits[stage]
        with np.errstate(all="ignore"):
            if stage in LIGHT:
                factor = np.abs(value / other)
                limit = limit * np.where(np.isfinite(factor), np.maximum(1.0, factor), 1.0)
            off = ~(ratios(stage, self.own[stage], value, limit)[0] <= 1) & judged
            telling = ~(ratios(stage, other, value, limit)[0] <= 2) & judged
        if stage in HITS and off.any() and self.scene(way).shapes != self.evidence.scene.shapes:
            judged &= ~self._in_one_place(way, stage)
        if stage is Stage.OBJECT and way is not NOTHING and off.any():
            judged &= ~self._tied(self.scene(way), value)
            telling &= ~self._tied(self.evidence.scene, other)
        off, telling = off & judged, telling & judged
        if stage in HITS and 0 < np.count_nonzero(off) <= NEARLY * off.size:
            mostly = np.count_nonzero(telling & ~off) > MOSTLY * np.count_nonzero(telling)
            own = bool(mostly or np.count_nonzero(off) <= FEW * off.size)
            judged &= ~self._by_rounding(way, stage, own=own)
        if stage in HITS and off.any() and np.count_nonzero(telling & off) <= NEARLY * off.size:
            judged &= ~self._apart_in_float32(way, stage, value)
        off, telling = off & judged, telling & judged
        return Tally.of(judged, off, telling)

    def _by_rounding(self, way: Way, stage: Stage, *, own: bool) -> np.ndarray:
        """Return the pixels (height, width) in which rounding decides what a ray or a feeler meets in a way's scene.

        If `own`, by the way's own formulas and stages, which takes long; else rightly.
        """
        scene, what = self.scene(way), Stage.VISIBILITY if stage is Stage.VISIBILITY else Stage.OBJECT
        formulas, spoilt = concerned(way.formulas, scene, what) if own else {}, way.stages.get(what) if own else None
        plain = scene is self.evidence.scene and not formulas and spoilt is None
        key = "rounding", what, own and not plain, None if plain else id(way)
        if key not in self._kept:
            unsure = np.array(self._in_one_place(way, stage))
            if stage is Stage.VISIBILITY:
                # A feeler from the edge of two faces starts above or below the other one, as the point was rounded.
                unsure |= self._by_rounding(way, Stage.OBJECT, own=own)

            def met(before: StageImages) -> np.ndarray:
                right = follows(replace(way, formulas=formulas), scene, what, before, self.evidence.oracle)
                given = Given(scene=scene, answers=before, right=right, parameter=0.0)
                return right if spoilt is None else np.asarray(spoilt(given))

            with np.errstate(all="ignore"):
                there = met(self.own)
                for aside, along in TURNS:
                    unsure |= np.any(met(self.own | beside(self.own, what, aside, along)) != there, axis=-1)
            self._kept[key] = way, unsure
        return self._kept[key][1]

    def _in_one_place(self, way: Way, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) that meet two surfaces in one place, or one where the eye or a light is."""
        scene = self.scene(way)
        key = "in one place", stage is Stage.VISIBILITY, None if scene is self.evidence.scene else id(way)
        if key not in self._kept:
            of_feelers = stage is Stage.VISIBILITY
            meeting = seen_from_a_surface(scene, self.own) if of_feelers else equally_far(scene, self.own[Stage.RAY])
            self._kept[key] = way, meeting
        return self._kept[key][1]

    def _tied(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return the pixels (height, width) whose own object is another one in the same plane as these."""
        tied = in_their_planes(scene, objects, self.own[Stage.POSITION])
        return tied & np.any(objects != self.own[Stage.OBJECT], axis=-1)

    def _apart_in_float32(self, way: Way, stage: Stage, value: np.ndarray) -> np.ndarray:
        """Return the pixels (height, width) in which the tracer by a way's formulas has another value in float32.

        A wrong formula has outlines that the right image lacks, and rounding decides there. Whether it meets a shape
        beyond that shape's bounds depends on the rays that the tracer sends together, so the whole image is traced.
        """
        scene, whole = self.scene(way), stage is not Stage.VISIBILITY and self.agrees(NOTHING, Stage.RAY) is True
        formulas = concerned(way.formulas, scene, stage)
        own = None if scene is self.evidence.scene else id(way)
        key = "rounded", own, tuple(sorted(formulas.items())), whole or stage
        if key not in self._kept:
            found: StageImages = {}  # beyond float32 it has no answer, and nothing can be said
            with np.errstate(all="ignore"), suppress(Unanswerable):
                if formulas and whole:
                    found = traced(scene, [Stage.OBJECT, Stage.DISTANCE], formulas, precision=PRECISION)
                elif formulas:
                    by = replace(way, formulas=formulas)
                    found[stage] = follows(by, scene, stage, self.own, self.evidence.oracle, precision=PRECISION)
            self._kept[key] = way, found
        with np.errstate(all="ignore"):
            rounded = self._kept[key][1].get(stage, value)
            return ~(ratios(stage, rounded, value, self._supposed.limits[stage])[0] <= 1)

    def agrees(self, way: Way, stage: Stage) -> bool | None:
        """Say whether the case does not contradict a way at a stage; None where the way has no answer."""
        tally = self.tally(way, stage)
        return None if tally is None else tally.fits

    @cached_property
    def wrong(self) -> tuple[Stage, ...]:
        """Return the stages that are not right for those before, in order."""
        return tuple(stage for stage in self.stages if self.agrees(NOTHING, stage) is False)

    def trial(self, way: Way) -> Tally | None:
        """Return what becomes of the case's pixels at all stages; None where the way has no answer at one.

        Where a stage contradicts the way, what becomes of them there.
        """
        tallies = [self.tally(way, stage) for stage in self.stages]
        known = [one for one in tallies if one is not None]
        if len(known) < len(tallies):
            return None
        for one in known:
            if not one.fits:
                return one
        return Tally(
            judged=max(one.judged for one in known),
            off=max(one.off for one in known),
            telling=sum(one.telling for one in known),
            agree=sum(one.agree for one in known),
        )


def concerned(formulas: Mapping[str, str], scene: Scene, stage: Stage) -> Mapping[str, str]:
    """Return the formulas that take part in a stage of a scene; none if no wrong one does."""
    found = {slot: one for slot, one in formulas.items() if _concerns(slot, one, scene, stage)}
    return found if any(FORMULAS[f"{slot}/{one}"].kind != "right" for slot, one in found.items()) else {}


def work(scene: Scene) -> int:
    """Return how much work a scene is: what every hypothesis meets first ought to be little."""
    faces = sum(len(shape.faces) if isinstance(shape, Mesh) else 1 for shape in scene.shapes)
    return scene.camera.width * scene.camera.height * (faces + 4) * (2 + len(scene.lights))


def _concerns(slot: str, variant: str, scene: Scene, stage: Stage) -> bool:
    """Say whether a formula takes part in a stage of a scene."""
    kind, first = OF_A_KIND.get(slot), FORMULAS[f"{slot}/{variant}"].stage
    if kind is not None and not any(isinstance(shape, kind) for shape in scene.shapes):
        return False
    parts = PARTS.get(first, (first,))
    return stage in parts or (slot == INTO_OBJECT_SPACE and stage in (Stage.POSITION, Stage.NORMAL))
