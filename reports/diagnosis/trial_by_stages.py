"""One hypothesis before one case, stage by stage: each as it follows from the renderer's own stages before it.

So mistakes of different stages do not meet: whatever rays a renderer has, its hits are right or wrong for them. A
mistake is judged where it is made, and of two mistakes each by itself, unless both spoil one stage.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, SceneError, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.diagnosis.answering import (
    LIGHT,
    PRECISION,
    TURNS,
    Answered,
    Unanswerable,
    between_faces,
    equally_far,
    follows,
    own_limits,
    seen_from_a_surface,
    turned_rays,
)
from rayproof.reports.diagnosis.trial import NEARLY, Evidence, Tally
from rayproof.reports.judge.measurement import ratios
from rayproof.tracer.formulas import FORMULAS

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
        return own_limits(self.evidence.scene, self.own)

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
        if changed or key not in self._kept:
            before = {one: self.own[one] for one in self.stages if IMAGE_STAGES.index(one) < IMAGE_STAGES.index(stage)}
            with np.errstate(all="ignore"):
                found = follows(replace(way, formulas=formulas), scene, stage, before, self.evidence.oracle)
            if not changed:
                self._kept[key] = found
        else:
            found = self._kept[key]
        if spoilt:
            with np.errstate(all="ignore"):
                found = way.stages[stage](Given(scene=scene, answers=self.own, right=found, parameter=0.0))
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
            return self.tally(NOTHING, stage)
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
        if stage in HITS and 0 < np.count_nonzero(off) <= NEARLY * off.size:
            judged &= ~self._by_rounding(way, stage) & ~self._apart_in_float32(way, stage, value)
            off, telling = off & judged, telling & judged
        return Tally(
            judged=int(np.count_nonzero(judged)),
            off=int(np.count_nonzero(off)),
            telling=int(np.count_nonzero(telling)),
            agree=int(np.count_nonzero(telling & ~off)),
        )

    def _by_rounding(self, way: Way, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) in which rounding decides what a ray or a feeler meets."""
        scene = self.scene(way)
        key = "rounding", stage is Stage.VISIBILITY, None if scene is self.evidence.scene else id(way)
        if key not in self._kept:
            if stage is Stage.VISIBILITY:
                # A feeler from the edge of two faces starts above or below the other one, as the point was rounded.
                found = seen_from_a_surface(scene, self.own) | self._by_rounding(way, Stage.OBJECT)
            else:
                found = equally_far(scene, self.own[Stage.RAY])
                met, oracle = self.value(NOTHING, Stage.OBJECT), self.evidence.oracle
                if scene is not self.evidence.scene:
                    met = oracle.continue_from(scene, Stage.OBJECT, self.own)
                for aside, along in TURNS:
                    turned = {Stage.RAY: turned_rays(self.own[Stage.RAY], aside, along)}
                    found |= np.any(oracle.continue_from(scene, Stage.OBJECT, turned) != met, axis=-1)
            self._kept[key] = way, found
        return self._kept[key][1]

    def _apart_in_float32(self, way: Way, stage: Stage, value: np.ndarray) -> np.ndarray:
        """Return the pixels (height, width) in which the tracer by a way's formulas has another value in float32.

        A wrong formula has borders of its own, of which the right answer knows nothing: rounding decides there.
        """
        scene = self.scene(way)
        formulas = concerned(way.formulas, scene, stage)
        if not formulas:
            return np.zeros(value.shape[:2], dtype=bool)
        before = {one: self.own[one] for one in self.stages if IMAGE_STAGES.index(one) < IMAGE_STAGES.index(stage)}
        try:
            with np.errstate(all="ignore"):
                plain = replace(way, formulas=formulas)
                rounded = follows(plain, scene, stage, before, self.evidence.oracle, precision=PRECISION)
        except Unanswerable:  # beyond float32, of which then nothing can be said
            return np.zeros(value.shape[:2], dtype=bool)
        if stage is Stage.DISTANCE:
            with np.errstate(all="ignore"):
                return ~(ratios(stage, rounded, value, self._supposed.limits[stage])[0] <= 1)
        return np.any(rounded != value, axis=-1)

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
