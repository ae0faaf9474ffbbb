"""`SceneTruth`: the oracle's answers, edges and conditioning of a scene, which all judging of it shares."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.conditioning import Conditioning, condition
from rayproof.reports.judge.edge_values import Edges
from rayproof.reports.judge.limits import Limits, Roundoff, limits
from rayproof.reports.judge.oracle import FullOracle
from rayproof.reports.judge.pixel_classes import Classes, Unrounded, classify, farther, unlit

T = TypeVar("T")
FARTHEST = 1e30  # m: as good as no far end, and its square is finite


@dataclass(frozen=True, kw_only=True)
class SceneTruth:
    """The part of judging that no subject changes, with a memo, since a case has many equal answers.

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

    def parts(self, key: tuple, where: np.ndarray, found: Callable[[np.ndarray], T]) -> list[T]:
        """Return what `found` returns of the pixels of `where` (height, width) and of earlier ones, each asked once."""
        asked, known = self.once(("parts", *key), lambda: (np.zeros_like(where), []))
        new = where & ~asked
        if new.any():
            asked |= new
            known.append(found(new))
        return known

    def author(self, renderer: Answers, stage: Stage) -> str | None:
        """Return the name by which the memo knows a renderer's answer to a stage; None where it has none.

        Raises:
            ValueError: another answer went by that name in this case, so that the memo would take one for the other.

        """
        image = renderer.answers.get(stage)
        if image is None:
            return None
        name = renderer.authors.get(stage, renderer.name)
        if self._answers.setdefault((name, stage), image) is not image:
            raise ValueError(f"{name} has two answers to {stage} in one case")
        return name

    def forgetful(self) -> "SceneTruth":
        """Return the same with an empty memo, for renderers of the same names with other answers."""
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
        return self.once(("limits", g, by_matrices), lambda: limits(*about, by_matrices=by_matrices))

    def together(self, one: Roundoff, other: Roundoff, *, by_matrices: tuple[bool, bool]) -> Limits:
        """Return the limits of two kinds of rounding added: what a difference of two renderers' answers may be."""
        key = ("limits together", one, other, by_matrices)
        each = zip((one, other), by_matrices, strict=True)
        return self.once(key, lambda: _added(*(self.limits(g, by_matrices=own) for g, own in each)))

    def continued_limits(
        self, ours: StageImages, roundoffs: Sequence[Roundoff], *, by_matrices: Sequence[bool]
    ) -> dict[Stage, np.ndarray]:
        """Return the limits of stages up to the normal, each by itself, for what a subject's own ray and object meet.

        Its own conditioning counts there, not that of what the oracle sees in the same pixel, which may be nothing.
        """
        objects = ours[Stage.OBJECT]
        named = (objects[..., :1] >= 0) & (objects[..., :1] < len(self.scene.shapes))  # nor is NaN
        met = {Stage.RAY: ours[Stage.RAY], Stage.OBJECT: np.where(named, objects, -1.0)}
        for stage in (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
            met[stage] = self.oracle.continue_from(self.scene, stage, met)
            if stage is Stage.DISTANCE and stage in ours:
                # Where its ray misses the shape by rounding, its own distance says where it hit, on a face that exists.
                counts = np.array([*(len(getattr(shape, "faces", "1")) for shape in self.scene.shapes), 0])
                face, faces = objects[..., 1:], counts[met[Stage.OBJECT][..., :1].astype(int)]
                lost = named & (face >= 0) & (face < faces) & ~np.isfinite(met[stage])
                met[stage] = np.where(lost, ours[stage], met[stage])
        met[Stage.OBJECT] = np.where(np.isfinite(met[Stage.DISTANCE]), met[Stage.OBJECT], -1.0)
        about = self.scene, met, condition(self.scene, met)
        each = [limits(*about, g, by_matrices=own).continued for g, own in zip(roundoffs, by_matrices, strict=True)]
        return {stage: np.sum([one[stage] for one in each], axis=0) for stage in each[0]}

    def beyond(self, distance: float) -> "SceneTruth":
        """Return the truth of what is seen if nothing nearer to the eye than a distance [m] is."""
        scene = _seen_beyond(self.scene, distance)
        stages = tuple(self.truth)
        return self.once(("beyond", distance), lambda: scene_truth(scene, stages, self.oracle, known={}))

    def clipped_elsewhere(self, moved: float) -> tuple["SceneTruth", ...]:
        """Return the truths of what is seen if both ends of clipping stand so much [m] farther apart, or closer."""
        return self.once(
            ("clipped elsewhere", moved),
            lambda: tuple(
                scene_truth(scene, tuple(self.truth), self.oracle, known={})
                for scene in _clipped_elsewhere(self.scene, moved)
            ),
        )

    def outlined(self, classes: Classes, edge_epsilon: float, tie_epsilon: float) -> Classes:
        """Return the classes for renderers whose outlines may lie so much [m] farther out."""
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
    images = ("cosine", "relative", "position", "aimed", "lifted")
    return Limits(
        continued={stage: mine.continued[stage] + theirs.continued[stage] for stage in mine.continued},
        end_to_end={stage: mine.end_to_end[stage] + theirs.end_to_end[stage] for stage in mine.end_to_end},
        **{name: getattr(mine, name) + getattr(theirs, name) for name in images},
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


def scene_truth(
    scene: Scene, stages: tuple[Stage, ...], oracle: FullOracle, *, known: StageImages | None = None
) -> SceneTruth:
    """Return the truth of a scene; `known` are the oracle's answers as far as they were given already."""
    truth = known if known is not None and set(stages) <= set(known) else oracle.render(scene, stages)
    return SceneTruth(
        scene=scene, truth=truth, edges=oracle.edges(scene), conditioning=condition(scene, truth), oracle=oracle
    )
