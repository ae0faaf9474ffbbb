"""`Comparison`: two renderers' answers to a scene with their limits, pixel classes and shadow epsilons."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage, StageImages, upto
from rayproof.reports.judge.answers import Answers, any_of, largest, length, limit_near
from rayproof.reports.judge.conditioning import Conditioning
from rayproof.reports.judge.edge_values import Lights
from rayproof.reports.judge.limits import (
    Coarseness,
    Limits,
    Roundoff,
    continued_light_limit,
    continued_position_limit,
    roundoff_of,
)
from rayproof.reports.judge.pixel_classes import Classes
from rayproof.reports.judge.scene_truth import SceneTruth

GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
AFTER_IRRADIANCE = 7  # roundings from irradiance to radiance, as the end-to-end limits count them


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Limits, pixel classes and epsilons of two renderers, computed once; they do not say which of the two is right."""

    base: SceneTruth
    subject: Answers
    reference: Answers

    @property
    def scene(self) -> Scene:
        """Return the scene judged."""
        return self.base.scene

    @property
    def truth(self) -> StageImages:
        """Return the oracle's answers."""
        return self.base.truth

    @property
    def conditioning(self) -> Conditioning:
        """Return how much the scene magnifies rounding."""
        return self.base.conditioning

    @cached_property
    def rounding(self) -> tuple:
        """Return what the limits depend on beside the truth of the scene."""
        each = zip(self.roundoffs, (self.subject, self.reference), strict=True)
        two = [(g, one.by_matrices, tuple(one.resolutions.items())) for g, one in each]
        # Both errors are added, so that their order tells nothing, but for outputs' steps, which count for the subject.
        return tuple(two if self._coarse else sorted(two, key=repr))

    @cached_property
    def rules(self) -> tuple:
        """Return what limits and classes depend on beside the truth of the scene."""
        epsilon = np.asarray(self.subject.shadow_epsilon + self.reference.shadow_epsilon, dtype=np.float64)
        near = self.subject.ray_epsilon, self.reference.ray_epsilon, self._light_epsilon, self.blurred
        return self.rounding, epsilon.tobytes(), near, self.subject.chained

    @cached_property
    def roundoffs(self) -> tuple[Roundoff, Roundoff]:
        """Return how the two round, without what they do to spheres alone where there are none."""
        two, curved = (self.subject, self.reference), any(isinstance(shape, Sphere) for shape in self.scene.shapes)
        mine, theirs = (replace(g, local=g.local and curved, short=g.short and curved) for g in map(roundoff, two))
        return mine, theirs

    def authors(self, stage: Stage) -> tuple[str | None, str | None]:
        """Return by whom the two answers to a stage are, as the memo knows them."""
        return self.base.author(self.subject, stage), self.base.author(self.reference, stage)

    def authors_upto(self, stage: Stage) -> tuple[str | None, ...]:
        """Return by whom the judged renderer's answers up to a stage are."""
        return tuple(self.base.author(self.subject, one) for one in upto(stage) if one is not Stage.CAMERA)

    @property
    def _by_matrices(self) -> tuple[bool, bool]:
        return self.subject.by_matrices, self.reference.by_matrices

    @property
    def _coarse(self) -> bool:
        return bool(self.subject.resolutions or self.reference.resolutions)

    @cached_property
    def _coarseness(self) -> tuple[Coarseness, Coarseness]:
        return Coarseness(resolutions=self.subject.resolutions), Coarseness(resolutions=self.reference.resolutions)

    def because(self, stage: Stage) -> str:
        """Return what the outputs' steps add to a stage's limit, in words that follow its derivation, or nothing."""
        names = (self.subject.name, self.reference.name)
        steps = "".join(one.because(stage, name) for one, name in zip(self._coarseness, names, strict=True))
        if stage is Stage.NORMAL and self.subject.world_normals:
            return f"{steps}; {self.subject.name} declares that it takes normals from float32 corners in world space"
        return steps

    @cached_property
    def limits(self) -> Limits:
        """Return the limits: the subject's rounding and output steps plus the reference's."""
        rounding = self.base.together(*self.roundoffs, by_matrices=self._by_matrices)
        if not self._coarse:
            return rounding
        return self.base.once(("coarse", self.rounding), lambda: self._coarsened(rounding))

    def _coarsened(self, rounding: Limits) -> Limits:
        """Return limits with the renderers' output steps added."""
        truth, whole = self.truth, dict(rounding.end_to_end)
        for stage in whole:
            whole[stage] = whole[stage] + sum(one.step(stage, truth[stage]) for one in self._coarseness)
        # The oracle continues from what the subject's output kept of its positions and normals.
        moved, turned = (self._coarseness[0].step(stage, truth[stage]) for stage in (Stage.POSITION, Stage.NORMAL))
        coarse = np.zeros_like(rounding.cosine)
        for index, light in enumerate(self.scene.lights):
            r = length(np.asarray(light.position) - truth[Stage.POSITION])
            coarse[..., index] = np.divide(moved, r, out=np.zeros_like(r), where=r > 0) + turned
        return replace(
            rounding,
            end_to_end=whole,
            cosine=rounding.cosine + coarse,
            relative=rounding.relative + coarse,
            position=rounding.position + moved,
            lifted=rounding.lifted + moved,
        )

    @cached_property
    def classes(self) -> Classes:
        """Return the pixel classes for the larger of the two roundoffs and the sum of the two epsilons."""
        return self._classes(self.subject.shadow_epsilon + self.reference.shadow_epsilon)

    @property
    def _light_epsilon(self) -> float:
        return self.subject.light_epsilon + self.reference.light_epsilon

    @property
    def blurred(self) -> tuple[float, float]:
        """Return how far [m] beyond an edge the two together may take points for inside, and surfaces for one."""
        subject, reference = self.subject, self.reference
        return subject.edge_epsilon + reference.edge_epsilon, subject.tie_epsilon + reference.tie_epsilon

    def _classes(self, shadow_epsilon: float | np.ndarray, *, blind: bool = True) -> Classes:
        """Return the classes for one epsilon; kept, since many renderers round and step alike.

        `blind` says that what a renderer does not see before a light counts.
        """
        g = max(self.roundoffs, key=lambda each: (each(1), each.short))
        light_epsilon = self._light_epsilon if blind else 0.0
        found = self.base.classes(self.limits, g, shadow_epsilon, light_epsilon, key=self.rounding)
        if not any(self.blurred):
            return found
        epsilon = np.asarray(shadow_epsilon, dtype=np.float64).tobytes()
        key = "farther", self.rounding, epsilon, light_epsilon, self.blurred
        return self.base.once(key, lambda: self.base.outlined(found, *self.blurred))

    @cached_property
    def window(self) -> np.ndarray:
        """Return the pixels (height, width) that only the renderers' own epsilons leave undecided."""
        unlit = np.zeros_like(self.classes.outline)
        epsilon = self.subject.shadow_epsilon + self.reference.shadow_epsilon
        if self.scene.lights and (np.any(epsilon > 0) or self._light_epsilon > 0):
            unlit = self.classes.undecided & ~self._classes(0.0, blind=False).undecided
        outline = self.classes.outline
        if any(self.blurred):
            plain = replace(self, subject=_sharp(self.subject), reference=_sharp(self.reference)).classes.outline
            unlit = (unlit | outline) & ~plain
            return self.near | unlit
        return self.near | (unlit & ~outline)

    def undecided_beyond(self, shadow_epsilon: float | np.ndarray) -> np.ndarray:
        """Return the pixels (height, width) that would be decided if the subject's shadow epsilon were this [m]."""
        smaller = self._classes(shadow_epsilon + self.reference.shadow_epsilon)
        return self.classes.undecided & ~smaller.undecided & ~self.classes.outline

    @cached_property
    def near(self) -> np.ndarray:
        """Return the pixels (height, width) whose hit lies nearer to the eye than a renderer sees."""
        nearest = self.subject.ray_epsilon + self.reference.ray_epsilon
        if not nearest:
            return np.zeros(self.conditioning.hit.shape, dtype=bool)
        return self.conditioning.hit & (self.conditioning.distance <= nearest + self._largest(Stage.DISTANCE))

    def _largest(self, stage: Stage) -> np.ndarray:
        limit = self.limits.end_to_end[stage]
        return largest(limit) if limit.ndim == 3 else limit

    def lights(
        self, stage: Stage, rows: np.ndarray, columns: np.ndarray, values: np.ndarray, objects: np.ndarray
    ) -> Lights:
        """Return what is known of the lights at some pixels, where the subject has `values` (pixels, 3) of light.

        `objects` (pixels, samples) are the shapes that may be seen there.
        """
        classes, scene, truth = self.classes, self.scene, self.truth
        outline = classes.outline[rows, columns][:, np.newaxis]
        relative = np.zeros((*objects.shape, len(scene.lights)))
        for index in np.unique(objects):
            near = self.base.once(("relative", self.rounding, index), lambda index=index: self._relative(index))
            relative = np.where((objects == index)[..., np.newaxis], near[rows, columns][:, np.newaxis], relative)
        r = [length(np.asarray(light.position) - truth[Stage.POSITION][rows, columns]) for light in scene.lights]
        apart = np.stack(r, axis=-1)
        other = np.where(self.twins, self.base.edges.gap, 0.0)[rows, columns][:, np.newaxis]
        with np.errstate(divide="ignore", invalid="ignore"):
            shifted = np.where(other > 0, 3 * other / apart, 0.0)
        close = apart <= 4 * self.limits.position[rows, columns][:, np.newaxis]
        free = classes.light[rows, columns] | close | outline
        steps = [np.broadcast_to(one.step(stage, values), values.shape) for one in self._coarseness]
        return Lights(
            decided=(truth[Stage.VISIBILITY][rows, columns] > 0) & ~free,
            free=free,
            close=close & self.conditioning.hit[rows, columns][:, np.newaxis],
            relative=relative + shifted[:, np.newaxis],
            rounding=sum(g(AFTER_IRRADIANCE) for g in self.roundoffs),
            step=steps[0] + steps[1],
        )

    @cached_property
    def twins(self) -> np.ndarray:
        """Return the pixels (height, width) that are outlines only because another surface lies where one is seen."""
        classes, edges = self.classes, self.base.edges
        if classes.outline.all():  # an unclipped surface may hold the eye
            return np.zeros_like(classes.outline)
        return (edges.gap <= classes.depth) & ~(edges.silhouette <= classes.reach)

    def _relative(self, index: float) -> np.ndarray:
        """Return each light's relative error on a shape (height, width, lights), wherever that is seen."""
        seen = np.where(self.conditioning.hit[..., np.newaxis], self.limits.relative, 0.0)
        return limit_near(self.truth[Stage.OBJECT][..., 0], seen, index)

    def continued_limit(self, stage: Stage, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return limit and edge pixels of a stage held against `value`, continued from the subject's own stages."""
        shape = self.classes.outline.shape
        edge = self.classes.outline if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL) else np.zeros(shape, bool)
        limit = self.limits.continued.get(stage, np.zeros(shape))
        if stage in (Stage.DISTANCE, Stage.NORMAL):
            limit = self._where_it_hit(stage, limit)
        if stage is Stage.POSITION:
            # By the tracer's own distance: at an outline it may have hit where the oracle's ray misses.
            limit = continued_position_limit(self.scene, self.subject.answers, self.roundoffs)
        if stage in LIGHT:
            edge = self.classes.flagged
            mine, other = (
                continued_light_limit(self.scene, stage, self.subject.answers, value, g) for g in self.roundoffs
            )
            limit = mine + other
        if self._coarse:
            mine, other = self._coarseness
            limit = limit + mine.step(stage, value) + other.step(stage, value)
            limit = limit + mine.handed_down(self.scene, stage, self.subject.answers, self.conditioning)
        if not self.subject.chained and stage in self.limits.end_to_end:
            # Stages by passes of their own: each is off by its own end-to-end error, and by as much what it is
            # continued from; at an edge the passes need not agree on the side.
            own = self.base.limits(self.roundoffs[0], by_matrices=self.subject.by_matrices)
            limit, edge = limit + 2 * own.end_to_end[stage], edge | self.classes.edge(stage)
        return limit, edge

    def _where_it_hit(self, stage: Stage, limit: np.ndarray) -> np.ndarray:
        """Return a continued limit that holds where the subject sees another object than the oracle's own ray."""
        ours = self.subject.answers
        if not {Stage.RAY, Stage.OBJECT} <= set(ours) or np.array_equal(ours[Stage.OBJECT], self.truth[Stage.OBJECT]):
            return limit
        authors = tuple(self.base.author(self.subject, one) for one in (Stage.RAY, Stage.OBJECT))
        own = self.base.once(
            ("where it hit", self.rounding, *authors),
            lambda: self.base.continued_limits(ours, self.roundoffs, by_matrices=self._by_matrices),
        )
        return np.where(any_of(ours[Stage.OBJECT] != self.truth[Stage.OBJECT]), own[stage], limit)


def roundoff(renderer: Answers) -> Roundoff:
    """Return a renderer's rounding: derived for the tracer and the oracle, calibrated for other references."""
    return roundoff_of(renderer.name, renderer.precision, world_normals=renderer.world_normals)


def _sharp(renderer: Answers) -> Answers:
    """Return a renderer whose outlines are where they are."""
    return replace(renderer, edge_epsilon=0.0, tie_epsilon=0.0)
