"""`AgainstOracle`: a renderer's answers to a scene, with each pixel of each stage judged against the oracle, once.

The result for two renderers follows from the results for each (`reports.judge.pairs`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, upto
from rayproof.reports.judge.answers import Answers, any_of, length, widest_near
from rayproof.reports.judge.forward.common_factors import ORACLES, CommonFactors
from rayproof.reports.judge.forward.conditioning import condition
from rayproof.reports.judge.forward.limits import (
    HIT,
    POINT,
    Coarseness,
    Limits,
    Roundoff,
    continued_light_limit,
    continued_position_limit,
    limits,
    roundoff_of,
)
from rayproof.reports.judge.measurement import Explained, Kind, StagePixels, held_to, kinds_of, ratios
from rayproof.reports.judge.nearby.clouds import LIGHT, SURFACE, Allowed
from rayproof.reports.judge.nearby.continued import Continuing
from rayproof.reports.judge.nearby.explaining import Asking, DecisionReach, Declared
from rayproof.reports.judge.nearby.problems import Problems, problems_of
from rayproof.reports.judge.scene_truth import SceneTruth

# Bits per pixel of the mask that is drawn over images for readers.
BY_ROUNDING, BY_EPSILON = 1, 2
AFTER_IRRADIANCE = 7  # roundings from irradiance to radiance, as the end-to-end limits count them


@dataclass(frozen=True, eq=False)
class AgainstOracle:
    """A renderer's answers against the oracle's, end to end and continued from its own stages."""

    base: SceneTruth
    renderer: Answers

    @cached_property
    def roundoff(self) -> Roundoff:
        """Return the renderer's roundoff: derived for the tracer and the oracle, calibrated for other references."""
        renderer = self.renderer
        roundoff = roundoff_of(renderer.name, renderer.precision, world_normals=renderer.world_normals)
        return replace(roundoff, radius=renderer.sample_radius)

    @cached_property
    def coarseness(self) -> Coarseness:
        """Return the steps of its output."""
        return Coarseness(resolutions=self.renderer.resolutions)

    @cached_property
    def own_limits(self) -> Limits:
        """Return the limits of its rounding and of its output's steps, without the oracle's own rounding."""
        rounding = self.base.limits(self.roundoff, by_matrices=self.renderer.by_matrices)
        if not self.renderer.resolutions:
            return rounding
        truth, whole = self.base.truth, dict(rounding.end_to_end)
        for stage in whole:
            whole[stage] = whole[stage] + self.coarseness.step(stage, truth[stage])
        return replace(rounding, end_to_end=whole)

    @cached_property
    def limits(self) -> Limits:
        """Return the limits of its difference from the oracle."""
        return self.own_limits.plus(self.base.limits(ORACLES, by_matrices=False))

    @property
    def rounding_limit(self) -> np.ndarray:
        """Return the limit (height, width, 3) of radiance without the output's steps."""
        parts = (self.base.limits(g, by_matrices=self.renderer.by_matrices) for g in (self.roundoff, ORACLES))
        return sum((limits.end_to_end[Stage.RADIANCE] for limits in parts), np.zeros(()))

    @cached_property
    def problems(self) -> Problems:
        """Return the problems within its rounding."""
        return problems_of(self.base.scene, self.renderer.precision, baked=self.roundoff.baked)

    @cached_property
    def declared(self) -> Declared:
        """Return its declared epsilons, as movements of nearby problems."""
        renderer = self.renderer
        edge = np.zeros(self.base.conditioning.hit.shape)
        if renderer.edge_epsilon:
            edge = edge + renderer.edge_epsilon * self.base.pixels_per_length
        return Declared(
            shadow=renderer.shadow_epsilon,
            ray=renderer.ray_epsilon,
            light=renderer.light_epsilon,
            edge=edge,
            edge_length=renderer.edge_epsilon,
            tie=renderer.tie_epsilon,
        )

    @cached_property
    def reach(self) -> DecisionReach:
        """Return the shifts due to rounding of the quantities that decide single pixels."""
        c, limits = self.base.conditioning, self.limits
        # On a miss, a nearby problem may hit the surface of a neighbouring pixel, so the neighbours' limits apply.
        lift, tie = (
            np.where(c.hit, limit, widest_near(limit)) for limit in (limits.lifted, limits.end_to_end[Stage.DISTANCE])
        )
        return DecisionReach(image=limits.end_to_end[Stage.RAY] / c.pixel_angle, lift=lift, tie=tie)

    def answers(self, stage: Stage) -> bool:
        """Return whether it has an answer to a stage in the scene's size."""
        image, truth = self.renderer.answers.get(stage), self.base.truth.get(stage)
        return image is not None and truth is not None and np.shape(image) == np.shape(truth)

    @cached_property
    def _compared(self) -> dict[Stage, tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Return limit, ratio and error of every image stage with an answer."""
        compared = {}
        for stage in IMAGE_STAGES:
            if self.answers(stage):
                limit = self.limits.end_to_end.get(stage, self.base.no_limit)
                compared[stage] = (limit, *ratios(stage, self.renderer.answers[stage], self.base.truth[stage], limit))
        return compared

    def ratio(self, stage: Stage) -> np.ndarray:
        """Return error over limit of a stage, (height, width), without regard to nearby problems."""
        return self._compared[stage][1]

    def over(self, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) of a stage that are over their limits."""
        return ~(self.ratio(stage) <= 1)

    @cached_property
    def explained(self) -> Mapping[Stage, Explained]:
        """Return the explanations by nearby problems of the pixels that are over their limits end to end."""
        over = {stage: self.over(stage) for stage in self._compared}
        over = {stage: mask for stage, mask in over.items() if mask.any()}
        if not over:
            return {}
        return self.asking(over).explain()

    def asking(self, over: Mapping[Stage, np.ndarray], *, keep: bool = False) -> Asking:
        """Return the comparison of pixels over their limits with nearby problems."""
        return Asking(
            oracle=self.base.oracle,
            problems=self.problems,
            stages=tuple(self.base.truth),
            answers=self.renderer.answers,
            over=over,
            reach=self.reach,
            declared=self.declared,
            allowed=self.allowed,
            chained=self.renderer.chained,
            keep=keep,
        )

    @cached_property
    def end_to_end(self) -> Mapping[Stage, StagePixels]:
        """Return the pixels of every image stage with an answer, compared with the oracle's."""
        return {
            stage: self._pixels(stage, self.base.truth[stage], *compared, self.explained.get(stage))
            for stage, compared in self._compared.items()
        }

    def _pixels(
        self,
        stage: Stage,
        value: np.ndarray,
        limit: np.ndarray,
        ratio: np.ndarray,
        error: np.ndarray,
        explained: Explained | None,
    ) -> StagePixels:
        # The relative error of a position refers to its distance from the eye, not from the world's origin.
        size = self.base.conditioning.distance if stage is Stage.POSITION else None
        kinds = kinds_of(ratio, *held_to(stage, limit, value, size), explained)
        return StagePixels(stage=stage, value=value, limit=limit, ratio=ratio, error=error, kinds=kinds)

    def continued(self, stage: Stage) -> StagePixels | None:
        """Return a stage compared with the oracle's value from the renderer's previous stages; None without these."""
        return self._continued.get(stage)

    @cached_property
    def _continued(self) -> Mapping[Stage, StagePixels]:
        continued = {}
        for stage in IMAGE_STAGES:
            before = set(upto(stage)[:-1]) - {Stage.CAMERA}
            if self.answers(stage) and all(self.answers(earlier) for earlier in before):
                continued[stage] = self._continue(stage)
        return continued

    def continued_value(self, stage: Stage) -> np.ndarray:
        """Return a stage (height, width, channels) as the oracle continues it from the renderer's own stages."""
        pixels = self._continued.get(stage)
        if pixels is not None:
            return pixels.value
        with np.errstate(all="ignore"):
            return self.base.oracle.continue_from(self.base.scene, stage, self.renderer.answers)

    def _continue(self, stage: Stage) -> StagePixels:
        answers, scene = self.renderer.answers, self.base.scene
        with np.errstate(all="ignore"):  # the renderer's stages may contain infinities
            value = self.base.oracle.continue_from(scene, stage, answers)
        limit = self.continued_limit(stage, value)
        ratio, error = ratios(stage, answers[stage], value, limit)
        over = ~(ratio <= 1)
        explained = None
        if over.any() and stage is not Stage.RAY:
            explained = Continuing(
                oracle=self.base.oracle,
                problems=self.problems,
                stage=stage,
                answers=answers,
                limit=limit,
                reach=self.reach,
                declared=self.declared,
                unit=UNIT_ROUNDOFF[self.renderer.precision],
                whole=self._moved_whole,
            ).explain(over)
        return self._pixels(stage, value, limit, ratio, error, explained)

    @cached_property
    def _moved_whole(self) -> Mapping[Stage, np.ndarray | float]:
        """Return the errors of its stages in addition to their rounding, from output steps and separate passes."""
        answers, moved = self.renderer.answers, {}
        for stage in IMAGE_STAGES[:-1]:
            if stage not in answers or stage in (Stage.OBJECT, Stage.VISIBILITY):
                continue
            off = self.coarseness.step(stage, answers[stage])
            if not self.renderer.chained:
                off = off + self.own_limits.end_to_end[stage]
            if np.any(off):
                moved[stage] = off
        return moved

    def continued_limit(self, stage: Stage, value: np.ndarray) -> np.ndarray:
        """Return the limit of a stage against `value`, continued from the renderer's own stages."""
        answers, g = self.renderer.answers, self.roundoff
        limit = self.limits.continued.get(stage, self.base.no_limit)
        if stage in (Stage.DISTANCE, Stage.NORMAL):
            limit = self._where_it_hit(stage, limit)
        if stage is Stage.POSITION:
            # By the renderer's own distance, because at an outline it may hit where the oracle's ray misses.
            limit = continued_position_limit(self.base.scene, answers, (g, ORACLES))
        if stage in LIGHT:
            renderer_limit, oracle_limit = (
                continued_light_limit(self.base.scene, stage, answers, value, roundoff) for roundoff in (g, ORACLES)
            )
            limit = renderer_limit + oracle_limit
        if self.renderer.resolutions:
            limit = limit + self.coarseness.step(stage, value)
            limit = limit + self.coarseness.handed_down(self.base.scene, stage, answers, self.base.conditioning)
        if not self.renderer.chained and stage in self.limits.end_to_end:
            # With separate passes, each stage has its own end-to-end error, and so have the stages before it.
            limit = limit + 2 * self.own_limits.end_to_end[stage]
        return limit

    def _where_it_hit(self, stage: Stage, limit: np.ndarray) -> np.ndarray:
        """Return a continued limit (height, width), corrected where renderer and oracle hit different objects.

        There the conditioning of the renderer's own hit applies, not that of the oracle's hit in the same pixel.
        """
        answers, scene = self.renderer.answers, self.base.scene
        rows, columns = np.nonzero(any_of(answers[Stage.OBJECT] != self.base.truth[Stage.OBJECT]))
        if not len(rows):
            return limit
        hits = {
            hit_stage: np.asarray(answers[hit_stage][rows, columns], dtype=np.float64)
            for hit_stage in (Stage.RAY, Stage.OBJECT)
        }
        named = self.base.oracle.known(scene, hits[Stage.OBJECT])[:, np.newaxis]
        hits[Stage.OBJECT] = np.where(named, hits[Stage.OBJECT], -1.0)
        with np.errstate(all="ignore"):
            distance = self.base.oracle.continued(scene, Stage.DISTANCE, hits)
            # Where its ray misses the shape due to rounding, its own distance determines the hit.
            own = np.asarray(answers[Stage.DISTANCE][rows, columns], dtype=np.float64)
            hits[Stage.DISTANCE] = np.where(named & ~np.isfinite(distance), own, distance)
            hits[Stage.OBJECT] = np.where(np.isfinite(hits[Stage.DISTANCE]), hits[Stage.OBJECT], -1.0)
            for hit_stage in (Stage.POSITION, Stage.NORMAL):
                hits[hit_stage] = self.base.oracle.continued(scene, hit_stage, hits)
        image = {hit_stage: values[:, np.newaxis] for hit_stage, values in hits.items()}
        c = condition(scene, image)
        limits_of_each = (
            limits(scene, image, c, g, by_matrices=self.renderer.by_matrices) for g in (self.roundoff, ORACLES)
        )
        changed = limit.copy()
        changed[rows, columns] = sum(own_limits.continued[stage][:, 0] for own_limits in limits_of_each)
        return changed

    def allowed(self, rows: np.ndarray, columns: np.ndarray, answer: Mapping[Stage, np.ndarray]) -> Allowed:
        """Return the allowed differences from a nearby problem's answer at pixels: the limits of that answer.

        An answer with a different object than the oracle's has different conditioning.
        """
        image: StageImages = {stage: values[:, np.newaxis] for stage, values in answer.items()}
        if Stage.VISIBILITY in image:
            image[Stage.VISIBILITY] = np.ones_like(image[Stage.VISIBILITY])
        scene, c = self.base.scene, condition(self.base.scene, image)
        own = limits(scene, image, c, self.roundoff, by_matrices=self.renderer.by_matrices)
        total = own.plus(limits(scene, image, c, ORACLES, by_matrices=False))
        steps = {}
        if self.renderer.resolutions:
            for stage in (*SURFACE, *LIGHT):
                if stage in self.renderer.resolutions and self.answers(stage):
                    step = self.coarseness.step(stage, np.asarray(self.renderer.answers[stage], dtype=np.float64))
                    steps[stage] = np.asarray(step)[rows, columns]
        return Allowed(
            limits={stage: total.end_to_end[stage][:, 0] for stage in SURFACE},
            lights=total.lights[:, 0] if Stage.IRRADIANCE in image else None,
            relative=total.relative[:, 0] if Stage.IRRADIANCE in image else None,
            roundings=self.roundoff(AFTER_IRRADIANCE) + ORACLES(AFTER_IRRADIANCE),
            steps=steps,
        )

    @cached_property
    def common_factors(self) -> CommonFactors:
        """Return the factors that its light shares over many pixels."""
        return CommonFactors(
            base=self.base,
            renderer=self.renderer,
            roundoff=self.roundoff,
            limits=self.limits,
            explained={stage: pixels.explained for stage, pixels in self.end_to_end.items()},
        )

    def undecided(self, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) whose value differs between nearby problems by more than its limit."""
        beside = self.base.beside_changes
        if stage is Stage.RAY or not beside.any():
            return np.zeros_like(beside)
        off = self.asking({stage: beside}).reach_of(stage, self.base.truth)
        limit = self.limits.end_to_end.get(stage, self.base.no_limit)
        with np.errstate(invalid="ignore"):
            return np.asarray(~(off <= (limit if limit.ndim == off.ndim else limit[..., np.newaxis])).all(axis=-1))

    @property
    def mask(self) -> np.ndarray:
        """Return the pixels that are over their limits and explained in any stage, as bits in uint8 (height, width)."""
        bits = np.zeros(self.base.conditioning.hit.shape, dtype=np.uint8)
        for pixels in self.end_to_end.values():
            bits[pixels.kinds == Kind.ROUNDING] |= BY_ROUNDING
            bits[pixels.kinds == Kind.EPSILON] |= BY_EPSILON
        return bits

    @cached_property
    def reach_of_radiance(self) -> np.ndarray:
        """Return the largest difference of the radiance of nearby problems from the oracle's, (height, width, 3).

        Only pixels next to a pixel with a different surface or different lights are examined: a nearby problem moves by
        far less than a pixel.
        """
        return self.asking({Stage.RADIANCE: self.base.beside_changes}).reach_of(Stage.RADIANCE, self.base.truth)

    @property
    def because(self) -> Mapping[Stage, str]:
        """Return the text that its output's steps add to the derivation of each stage's limit, or ""."""
        reasons = {stage: self.coarseness.because(stage, self.renderer.name) for stage in IMAGE_STAGES}
        if self.renderer.world_normals:
            reasons[Stage.NORMAL] += (
                f"; {self.renderer.name} declares that it takes normals from float32 corners in world space"
            )
        return reasons


def needed_shadow(against: AgainstOracle) -> np.ndarray:
    """Return the distance [m] (height, width) of a rounded hit from its surface, for itself and for a shadow ray."""
    base, g = against.base, Roundoff(against.renderer.precision)
    c, eye = base.conditioning, float(np.linalg.norm(base.scene.camera.eye))
    return g(HIT) * (c.surface + c.point) + g(POINT) * (eye + c.distance + length(base.truth[Stage.POSITION]))
