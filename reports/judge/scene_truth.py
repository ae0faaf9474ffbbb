"""The ground that all judging of a scene stands on: the oracle's truth, its edges, the scene's conditioning."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers, any_of, largest, length, limit_near
from rayproof.reports.judge.conditioning import Conditioning, Unrounded, condition
from rayproof.reports.judge.edge_classes import Classes, classify, farther, unlit
from rayproof.reports.judge.edge_values import Edges, Lights
from rayproof.reports.judge.limits import (
    Coarseness,
    Limits,
    Roundoff,
    calibration,
    continued_light_limit,
    continued_position_limit,
    limits,
)
from rayproof.reports.judge.oracle import FullOracle

T = TypeVar("T")
FARTHEST = 1e30  # m: as good as no far end, and its square is finite


@dataclass(frozen=True, kw_only=True)
class Ground:
    """What does not depend on who is judged, and a memo: few kinds of rounding, and many equal answers, meet in a case.

    Of one name there is one answer to each stage; the memo goes by names (`author`).
    """

    scene: Scene
    truth: StageImages
    edges: Edges
    conditioning: Conditioning
    oracle: FullOracle
    _known: dict[tuple, Any] = field(default_factory=dict)
    _answers: dict[tuple[str, Stage], Any] = field(default_factory=dict)

    def once(self, key: tuple, found: Callable[[], T]) -> T:
        """Return what `found` returns, computed once for `key`, which holds all that it depends on beside the scene."""
        if key not in self._known:
            self._known[key] = found()
        return self._known[key]

    def author(self, party: Answers, stage: Stage) -> str | None:
        """Return the name by which the memo knows a party's answer to a stage; None where it has none.

        Raises:
            ValueError: another answer went by that name in this case, so that the memo would take one for the other.

        """
        image = party.answers.get(stage)
        if image is None:
            return None
        name = party.authors.get(stage, party.name)
        if self._answers.setdefault((name, stage), image) is not image:
            raise ValueError(f"{name} has two answers to {stage} in one case")
        return name

    def forgetful(self) -> "Ground":
        """Return the same with an empty memo, for parties of the same names with other answers."""
        return replace(self, _known={}, _answers={})

    @cached_property
    def _unrounded(self) -> Unrounded:
        return Unrounded(scene=self.scene, truth=self.truth, edges=self.edges, conditioning=self.conditioning)

    def thrown(self, light: int) -> np.ndarray:
        """Return how far off [m per roundoff] (height, width) a blocker's own error may make its shadow of a light."""
        return self._unrounded.blocker * self._unrounded.lamps[light].throw

    def limits(self, g: Roundoff, *, by_matrices: bool) -> Limits:
        """Return the limits of one kind of rounding."""
        about = self.scene, self.truth, self.conditioning, g
        return self.once(("limits", g.key, by_matrices), lambda: limits(*about, by_matrices=by_matrices))

    def together(self, one: Roundoff, other: Roundoff, *, by_matrices: tuple[bool, bool]) -> Limits:
        """Return the limits of two kinds of rounding added: what a difference of two parties' answers may be."""
        key = ("limits together", one.key, other.key, by_matrices)
        each = zip((one, other), by_matrices, strict=True)
        return self.once(key, lambda: _added(*(self.limits(g, by_matrices=own) for g, own in each)))

    def continued_limits(
        self, ours: StageImages, roundoffs: Sequence[Roundoff], *, by_matrices: Sequence[bool]
    ) -> dict[Stage, np.ndarray]:
        """Return the limits of stages up to the normal, each by itself, for what a candidate's own ray and object meet.

        Its own conditioning counts there, not that of what the oracle sees in the same pixel, which may be nothing.
        """
        objects = ours[Stage.OBJECT]
        named = (objects[..., :1] >= 0) & (objects[..., :1] < len(self.scene.shapes))  # nor is NaN
        met = {Stage.RAY: ours[Stage.RAY], Stage.OBJECT: np.where(named, objects, -1.0)}
        for stage in (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
            met[stage] = self.oracle.continue_from(self.scene, stage, met)
        met[Stage.OBJECT] = np.where(np.isfinite(met[Stage.DISTANCE]), met[Stage.OBJECT], -1.0)
        about = self.scene, met, condition(self.scene, met)
        each = [limits(*about, g, by_matrices=own).continued for g, own in zip(roundoffs, by_matrices, strict=True)]
        return {stage: np.sum([one[stage] for one in each], axis=0) for stage in each[0]}

    def beyond(self, distance: float) -> "Ground":
        """Return the ground of what is seen if nothing nearer to the eye than a distance [m] is."""
        scene = _seen_beyond(self.scene, distance)
        stages = tuple(self.truth)
        return self.once(("beyond", distance), lambda: ground(scene, stages, self.oracle, known={}))

    def clipped_elsewhere(self, moved: float) -> tuple["Ground", ...]:
        """Return the grounds of what is seen if both ends of clipping stand so much [m] farther apart, or closer."""
        return self.once(
            ("clipped elsewhere", moved),
            lambda: tuple(
                ground(scene, tuple(self.truth), self.oracle, known={})
                for scene in _clipped_elsewhere(self.scene, moved)
            ),
        )

    def outlined(self, classes: Classes, edge_epsilon: float, tie_epsilon: float) -> Classes:
        """Return the classes for parties whose outlines may lie so much [m] farther out."""
        return farther(classes, self.edges, self.conditioning, edge_epsilon, tie_epsilon)

    def classes(
        self, limits: Limits, g: Roundoff, shadow_epsilon: float | np.ndarray, light_epsilon: float = 0.0, *, key: tuple
    ) -> Classes:
        """Return the pixel classes under limits; `key` says which ones these are."""
        about = (self.scene, self.truth, self.edges, self.conditioning, limits, g)
        before = self.once(("unlit", key), lambda: unlit(self._unrounded, limits, g))
        whole = ("classes", key, np.asarray(shadow_epsilon, dtype=np.float64).tobytes(), light_epsilon)
        epsilons = {"shadow_epsilon": shadow_epsilon, "light_epsilon": light_epsilon}
        return self.once(whole, lambda: classify(*about, **epsilons, before=before))


def _added(mine: Limits, theirs: Limits) -> Limits:
    return Limits(
        continued={stage: mine.continued[stage] + theirs.continued[stage] for stage in mine.continued},
        end_to_end={stage: mine.end_to_end[stage] + theirs.end_to_end[stage] for stage in mine.end_to_end},
        cosine=mine.cosine + theirs.cosine,
        relative=mine.relative + theirs.relative,
        position=mine.position + theirs.position,
        aimed=mine.aimed + theirs.aimed,
        lifted=mine.lifted + theirs.lifted,
    )


def _clipped_elsewhere(scene: Scene, moved: float) -> tuple[Scene, Scene]:
    """Return the scene with both ends of clipping moved [m] apart, and with both moved towards each other."""
    camera = scene.camera
    moved = min(moved, camera.near / 2, (camera.far - camera.near) / 4)
    wide = replace(camera, near=camera.near - moved, far=camera.far + moved)
    narrow = replace(camera, near=camera.near + moved, far=camera.far - moved)
    return replace(scene, camera=wide), replace(scene, camera=narrow)


def _seen_beyond(scene: Scene, distance: float) -> Scene:
    """Return the scene of which nothing nearer to the eye than a distance [m] is seen."""
    camera = scene.camera
    aside = math.tan(camera.alpha) * math.hypot(1.0, camera.aspect)
    # Planes of constant depth and spheres about the eye: a corner's ray meets the far plane the farthest out.
    far = {"depth": camera.far * math.hypot(1.0, aside), "shell": camera.far, "none": FARTHEST}[scene.clip]
    seen = replace(camera, near=distance, far=max(far, distance * (1 + 1e-9)))
    return replace(scene, camera=seen, clip="shell")


def ground(scene: Scene, stages: tuple[Stage, ...], oracle: FullOracle, *, known: StageImages | None = None) -> Ground:
    """Return the ground of a scene; `known` are the oracle's answers as far as they were given already."""
    truth = known if known is not None and set(stages) <= set(known) else oracle.render(scene, stages)
    return Ground(
        scene=scene, truth=truth, edges=oracle.edges(scene), conditioning=condition(scene, truth), oracle=oracle
    )


# The terms on which a candidate is held against a witness: what the two may differ by, and in which pixels.


AFTER_IRRADIANCE = 7  # roundings from irradiance to radiance, as the end-to-end limits count them
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@dataclass(frozen=True, kw_only=True)
class Terms:
    """Limits, pixel classes and epsilons of one pair, computed once; who is right they do not say."""

    ground: Ground
    candidate: Answers
    witness: Answers

    @property
    def scene(self) -> Scene:
        """Return the scene judged."""
        return self.ground.scene

    @property
    def truth(self) -> StageImages:
        """Return the oracle's answers."""
        return self.ground.truth

    @property
    def conditioning(self) -> Conditioning:
        """Return how much the scene magnifies rounding."""
        return self.ground.conditioning

    @cached_property
    def rounding(self) -> tuple:
        """Return what the limits depend on beside the ground."""
        steps = tuple(tuple(party.resolutions.items()) for party in (self.candidate, self.witness))
        return tuple(each.key for each in self.roundoffs), self._by_matrices, steps

    @cached_property
    def rules(self) -> tuple:
        """Return what limits and classes depend on beside the ground."""
        epsilon = np.asarray(self.candidate.shadow_epsilon + self.witness.shadow_epsilon, dtype=np.float64)
        near = self.candidate.ray_epsilon, self.witness.ray_epsilon, self._light_epsilon, self.blurred
        return self.rounding, epsilon.tobytes(), near, self.candidate.chained

    @cached_property
    def roundoffs(self) -> tuple[Roundoff, Roundoff]:
        """Return how the two round."""
        return roundoff(self.candidate), roundoff(self.witness)

    @property
    def _by_matrices(self) -> tuple[bool, bool]:
        return self.candidate.by_matrices, self.witness.by_matrices

    @property
    def _coarse(self) -> bool:
        return bool(self.candidate.resolutions or self.witness.resolutions)

    @cached_property
    def _coarseness(self) -> tuple[Coarseness, Coarseness]:
        return Coarseness(resolutions=self.candidate.resolutions), Coarseness(resolutions=self.witness.resolutions)

    def because(self, stage: Stage) -> str:
        """Return what the parties' outputs add to a stage's limit, in words that follow its derivation, or nothing."""
        names = (self.candidate.name, self.witness.name)
        steps = "".join(one.because(stage, name) for one, name in zip(self._coarseness, names, strict=True))
        if stage is Stage.NORMAL and self.candidate.world_normals:
            return f"{steps}; {self.candidate.name} declares that it takes normals from float32 corners in world space"
        return steps

    @cached_property
    def limits(self) -> Limits:
        """Return the limits: the candidate's rounding and output steps plus the witness's."""
        rounding = self.ground.together(*self.roundoffs, by_matrices=self._by_matrices)
        if not self._coarse:
            return rounding
        return self.ground.once(("coarse", self.rounding), lambda: self._coarsened(rounding))

    def _coarsened(self, rounding: Limits) -> Limits:
        """Return limits with the parties' output steps added."""
        truth, whole = self.truth, dict(rounding.end_to_end)
        for stage in whole:
            whole[stage] = whole[stage] + sum(one.step(stage, truth[stage]) for one in self._coarseness)
        # The oracle continues from what the candidate's output kept of its positions and normals.
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
        return self._classes(self.candidate.shadow_epsilon + self.witness.shadow_epsilon)

    @property
    def _light_epsilon(self) -> float:
        return self.candidate.light_epsilon + self.witness.light_epsilon

    @property
    def blurred(self) -> tuple[float, float]:
        """Return how far [m] beyond an edge the two together may take points for inside, and surfaces for one."""
        candidate, witness = self.candidate, self.witness
        return candidate.edge_epsilon + witness.edge_epsilon, candidate.tie_epsilon + witness.tie_epsilon

    def _classes(self, shadow_epsilon: float | np.ndarray, *, blind: bool = True) -> Classes:
        """Return the classes for one epsilon; kept on the ground, since many parties round and step alike.

        `blind` says that what a party does not see before a light counts.
        """
        g, light_epsilon = max(self.roundoffs, key=lambda each: each(1)), self._light_epsilon if blind else 0.0
        found = self.ground.classes(self.limits, g, shadow_epsilon, light_epsilon, key=self.rounding)
        if not any(self.blurred):
            return found
        epsilon = np.asarray(shadow_epsilon, dtype=np.float64).tobytes()
        key = "farther", self.rounding, epsilon, light_epsilon, self.blurred
        return self.ground.once(key, lambda: self.ground.outlined(found, *self.blurred))

    @cached_property
    def window(self) -> np.ndarray:
        """Return the pixels (height, width) that only the parties' own epsilons leave undecided."""
        unlit = np.zeros_like(self.classes.outline)
        epsilon = self.candidate.shadow_epsilon + self.witness.shadow_epsilon
        if self.scene.lights and (np.any(epsilon > 0) or self._light_epsilon > 0):
            unlit = self.classes.undecided & ~self._classes(0.0, blind=False).undecided
        outline = self.classes.outline
        if any(self.blurred):
            plain = replace(self, candidate=_sharp(self.candidate), witness=_sharp(self.witness)).classes.outline
            unlit = (unlit | outline) & ~plain
            return self.near | unlit
        return self.near | (unlit & ~outline)

    def undecided_beyond(self, shadow_epsilon: float | np.ndarray) -> np.ndarray:
        """Return the pixels (height, width) that would be decided if the candidate's shadow epsilon were this [m]."""
        smaller = self._classes(shadow_epsilon + self.witness.shadow_epsilon)
        return self.classes.undecided & ~smaller.undecided & ~self.classes.outline

    @cached_property
    def near(self) -> np.ndarray:
        """Return the pixels (height, width) whose hit lies nearer to the eye than a party sees."""
        nearest = self.candidate.ray_epsilon + self.witness.ray_epsilon
        if not nearest:
            return np.zeros(self.conditioning.hit.shape, dtype=bool)
        return self.conditioning.hit & (self.conditioning.distance <= nearest + self._largest(Stage.DISTANCE))

    def _largest(self, stage: Stage) -> np.ndarray:
        limit = self.limits.end_to_end[stage]
        return largest(limit) if limit.ndim == 3 else limit

    def lights(
        self, stage: Stage, rows: np.ndarray, columns: np.ndarray, values: np.ndarray, objects: np.ndarray
    ) -> Lights:
        """Return what is known of the lights at some pixels, where the candidate has `values` (pixels, 3) of light.

        `objects` (pixels, samples) are the shapes that may be seen there.
        """
        classes, scene, truth = self.classes, self.scene, self.truth
        outline = classes.outline[rows, columns][:, np.newaxis]
        relative = np.zeros((*objects.shape, len(scene.lights)))
        for index in np.unique(objects):
            near = self.ground.once(("relative", self.rounding, index), lambda index=index: self._relative(index))
            relative = np.where((objects == index)[..., np.newaxis], near[rows, columns][:, np.newaxis], relative)
        r = [length(np.asarray(light.position) - truth[Stage.POSITION][rows, columns]) for light in scene.lights]
        apart = np.stack(r, axis=-1)
        other = np.where(self.twins, self.ground.edges.gap, 0.0)[rows, columns][:, np.newaxis]
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
        classes, edges = self.classes, self.ground.edges
        if classes.outline.all():  # an unclipped surface may hold the eye
            return np.zeros_like(classes.outline)
        return (edges.gap <= classes.depth) & ~(edges.silhouette <= classes.reach)

    def _relative(self, index: float) -> np.ndarray:
        """Return each light's relative error on a shape (height, width, lights), wherever that is seen."""
        seen = np.where(self.conditioning.hit[..., np.newaxis], self.limits.relative, 0.0)
        return limit_near(self.truth[Stage.OBJECT][..., 0], seen, index)

    def continued(self, stage: Stage, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return limit and edge pixels of a stage held against `value`, continued from the candidate's own stages."""
        shape = self.classes.outline.shape
        edge = self.classes.outline if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL) else np.zeros(shape, bool)
        limit = self.limits.continued.get(stage, np.zeros(shape))
        if stage in (Stage.DISTANCE, Stage.NORMAL):
            limit = self._where_it_hit(stage, limit)
        if stage is Stage.POSITION:
            # By the tracer's own distance: at an outline it may have hit where the oracle's ray misses.
            limit = continued_position_limit(self.scene, self.candidate.answers, self.roundoffs)
        if stage in LIGHT:
            edge = self.classes.flagged
            mine, other = (
                continued_light_limit(self.scene, stage, self.candidate.answers, value, g) for g in self.roundoffs
            )
            limit = mine + other
        if self._coarse:
            mine, other = self._coarseness
            limit = limit + mine.step(stage, value) + other.step(stage, value)
            limit = limit + mine.handed_down(self.scene, stage, self.candidate.answers, self.conditioning)
        if not self.candidate.chained and stage in self.limits.end_to_end:
            # Stages by passes of their own: each is off by its own end-to-end error, and by as much what it is
            # continued from; at an edge the passes need not agree on the side.
            own = self.ground.limits(self.roundoffs[0], by_matrices=self.candidate.by_matrices)
            limit, edge = limit + 2 * own.end_to_end[stage], edge | self.classes.edge(stage)
        return limit, edge

    def _where_it_hit(self, stage: Stage, limit: np.ndarray) -> np.ndarray:
        """Return a continued limit that holds where the candidate sees another object than the oracle's own ray."""
        ours = self.candidate.answers
        assert ours is not None
        if not {Stage.RAY, Stage.OBJECT} <= set(ours) or np.array_equal(ours[Stage.OBJECT], self.truth[Stage.OBJECT]):
            return limit
        authors = tuple(self.ground.author(self.candidate, one) for one in (Stage.RAY, Stage.OBJECT))
        own = self.ground.once(
            ("where it hit", self.rounding, *authors),
            lambda: self.ground.continued_limits(ours, self.roundoffs, by_matrices=self._by_matrices),
        )
        return np.where(any_of(ours[Stage.OBJECT] != self.truth[Stage.OBJECT]), own[stage], limit)


def roundoff(party: Answers) -> Roundoff:
    """Return a party's rounding: derived for the tracer and the oracle, calibrated for other references."""
    known = calibration(party.name)
    return Roundoff(
        party.precision,
        scale=known.factor,
        baked=known.baked_normals or party.world_normals,
        placed=known.placed_corners or party.world_normals,
        local=known.local_hits,
    )


def _sharp(party: Answers) -> Answers:
    """Return a party whose outlines are where they are."""
    return replace(party, edge_epsilon=0.0, tie_epsilon=0.0)
