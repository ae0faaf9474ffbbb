"""A renderer's values held against certified ones: pixel by pixel right, wrong, or nobody's to decide."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.certified import Certified
from rayproof.reference.certified.stages import continued
from rayproof.reports.judge.against_oracle import AgainstOracle, needed_shadow
from rayproof.reports.judge.answers import Answers, all_of, any_of, largest, widest_near
from rayproof.reports.judge.forward.conditioning import LEAST_COSINE
from rayproof.reports.judge.forward.limits import HIT, Roundoff, calibration, continued_light_limit
from rayproof.reports.judge.measurement import ratios
from rayproof.reports.judge.promises import ALLOWED
from rayproof.reports.judge.scene_truth import SceneTruth
from tests.harness.verdicts.perturbed import as_read, horizons, perturbed

CERTIFIED = Certified()
NAME = "certified"
AMOUNTS = (2.0, 8.0, 32.0)  # units of roundoff by which a scene is perturbed; limits count 16 roundings and more
TRIALS = 6  # scenes an amount
SLACK = 2.0  # limits: analytic's own error is in the judge's, and not in this comparison
JUMP = 10.0  # limits between the answers of scenes within rounding: more is a jump, and no error that grows
RARE = 8  # times as many, of what is still wrong: an answer that few of the scenes within rounding have
MOST = 40  # pixels of a renderer that are asked about in perturbed scenes

Pixel = tuple[int, int]  # column, row
GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
# The decisions on which a stage's value depends.
LIT = {stage: (Stage.OBJECT,) if stage in GEOMETRY else (Stage.OBJECT, Stage.VISIBILITY) for stage in IMAGE_STAGES}


def certified_answers(scene: Scene, stages: tuple[Stage, ...]) -> StageImages | None:
    """Return certified images of a scene, NaN where a tie cannot be decided; None if it has too many triangles."""
    if CERTIFIED.unsupported(scene, stages[-1]) is not None:
        return None
    height, width = scene.camera.height, scene.camera.width
    rows, columns = np.indices((height, width))
    points = np.stack([columns, rows], axis=-1).reshape(-1, 2) + 0.5
    found = CERTIFIED.at(scene, stages, points, exactly=False)
    return {stage: image.reshape(height, width, -1) for stage, image in found.items()}


def reach_of(against: AgainstOracle) -> np.ndarray:
    """Return how far rounding moves what a pixel shows, (height, width) [px]: by its ray, and by what it hits."""
    c, limits = against.base.conditioning, against.limits
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.nan_to_num(np.where(c.hit, limits.position / c.distance, 0.0))
    return (limits.end_to_end[Stage.RAY] + widest_near(seen)) / c.pixel_angle


@dataclass(kw_only=True)
class Nearby:
    """Certified answers of scenes within rounding, at some image points: stage -> (scenes, points, channels)."""

    scene: Scene
    stages: tuple[Stage, ...]
    points: np.ndarray  # (n, 2) px: pixel centres
    reach: np.ndarray  # (n,) px: how far rounding moves each point
    precision: str
    baked: bool
    samples: dict[Stage, np.ndarray] = field(default_factory=dict)

    def more(self, amount: float, truth: dict[Stage, np.ndarray], *, batch: int = 0) -> None:
        """Add the trials of one amount; the scene as it is, and as read, come first, with the answers `truth`."""
        if not self.samples:
            self.samples = {stage: truth[stage][np.newaxis] for stage in self.stages}
            if self.precision != "float64":
                self._add(as_read(self.scene, self.precision), self.points)
        generator, roundoff = np.random.default_rng(int(amount) + 1000 * batch), UNIT_ROUNDOFF[self.precision]
        for number in range(TRIALS):
            scene = perturbed(self.scene, generator, amount * roundoff, unshared=number % 2 == 1, baked=self.baked)
            shift = np.minimum(self.reach * amount / AMOUNTS[-1] * 2, 0.75)[:, np.newaxis]
            self._add(scene, self.points + shift * generator.uniform(-1, 1, self.points.shape))

    def _add(self, scene: Scene, points: np.ndarray) -> None:
        """Add the certified answers of a scene at points (n, 2)."""
        found = CERTIFIED.at(scene, self.stages, points, exactly=False)
        for stage in self.stages:
            self.samples[stage] = np.concatenate([self.samples[stage], found[stage][np.newaxis]])


@dataclass(frozen=True, kw_only=True)
class Held:
    """One party's answers, held against certified ones by the judge's limits for its precision."""

    base: SceneTruth
    truth: StageImages  # certified, NaN where undecided
    party: Answers
    granted: float = ALLOWED  # times what rounding needs of its shadow epsilon: all of it where a warning names it

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Return the image stages that the party answered in the right size."""
        answers = self.party.answers
        return tuple(
            stage
            for stage in IMAGE_STAGES
            if stage in answers and stage in self.truth and np.shape(answers[stage]) == self.truth[stage].shape
        )

    @cached_property
    def exact(self) -> Answers:
        """Return exact arithmetic as a witness; where it leaves a tie open it has the party's own value."""
        answers = dict(self.truth)
        for stage in self.stages:
            ours = np.asarray(self.party.answers[stage], dtype=np.float64)
            answers[stage] = np.where(np.isnan(self.truth[stage]), ours, self.truth[stage])
        return Answers(name=NAME, precision="float64", independent=True, answers=answers)

    @cached_property
    def against(self) -> AgainstOracle:
        """Return the party's limits, of which exact arithmetic takes the oracle's part."""
        return AgainstOracle(self.base, self.party)

    def limit(self, stage: Stage) -> np.ndarray:
        """Return the largest error (height, width, ...) end to end."""
        shape = self.truth[stage].shape[:2]
        return self.against.limits.end_to_end.get(stage, np.zeros(shape))

    def ratio(self, stage: Stage) -> np.ndarray:
        """Return error over limit (height, width) against the certified value; infinite where that is a tie's."""
        ours = np.asarray(self.party.answers[stage], dtype=np.float64)
        return ratios(stage, ours, self.truth[stage], self.limit(stage))[0]

    @cached_property
    def over(self) -> dict[Stage, np.ndarray]:
        """Return the pixels (height, width) whose value is not within the limit of the certified one."""
        return {stage: ~(self.ratio(stage) <= 1) for stage in self.stages}

    @cached_property
    def chosen(self) -> list[Pixel]:
        """Return pixels that are over a limit: the worst of each stage, strictly judged ones first."""
        wanted: dict[Pixel, None] = {}
        each = max(4, MOST // max(1, sum(bool(mask.any()) for mask in self.over.values())))
        for stage, mask in self.over.items():
            rows, columns = np.nonzero(mask)
            inside = ~self.base.beside_changes[rows, columns]
            tie = any_of(np.isnan(self.truth[stage]))[rows, columns]
            order = np.lexsort((-self.ratio(stage)[rows, columns], ~inside, tie))[:each]
            wanted |= {(int(columns[i]), int(rows[i])): None for i in order}
        return list(wanted)

    def wrong(self, pixels: list[Pixel], *, strictly: bool) -> dict[Pixel, tuple[Stage, ...]]:
        """Return of pixels the stages whose value no scene within rounding has.

        A value within the limit of the certified one is right whatever else holds. A tie that stays one in scenes
        within rounding is nobody's fault and left out. Who is accused has the benefit of all these scenes; `strictly`,
        for who passed, they count only where rounding, or what the party declares as far as rounding needs it, changes
        a decision: elsewhere the limit holds.
        """
        if not pixels or not self.stages:
            return {}
        left, tied = self._left(np.array(pixels), [(amount, 0) for amount in AMOUNTS], strictly=strictly)
        doubtful = np.flatnonzero(np.any(list(left.values()), axis=0))
        if len(doubtful):
            # Of all these pixels few are left, of which so many scenes may be asked that a rare one is among them.
            rare = [(amount, batch) for batch in range(1, RARE + 1) for amount in AMOUNTS]
            again, also = self._left(np.array(pixels)[doubtful], rare, strictly=strictly)
            horizon = self._on_the_horizon(np.array(pixels)[doubtful])
            for stage, mask in left.items():
                mask[doubtful] &= again[stage]
                tied[stage][doubtful] |= also[stage] | (horizon & (Stage.VISIBILITY in (stage, *LIT[stage])))
        wrong = {
            pixels[i]: tuple(stage for stage in self.stages if left[stage][i] and not tied[stage][i]) for i in doubtful
        }
        return {pixel: stages for pixel, stages in wrong.items() if stages}

    def _left(
        self, pixels: np.ndarray, amounts: list[tuple[float, int]], *, strictly: bool
    ) -> tuple[dict[Stage, np.ndarray], dict[Stage, np.ndarray]]:
        """Return of pixels (n, 2) by stage which values (n,) no scene has, and which stay tied in some.

        What is decided before a stage is tied for it as well.
        """
        columns, rows = pixels.T
        left = {stage: self.over[stage][rows, columns] for stage in self.stages}
        truth = {stage: self.truth[stage][rows, columns] for stage in self.stages}
        near = Nearby(
            scene=self.base.scene,
            stages=self.stages,
            points=pixels + 0.5,
            reach=reach_of(self.against)[rows, columns],
            precision=self.party.precision,
            baked=calibration(self.party.name).baked,
        )
        for amount, batch in amounts:
            if not any(mask.any() for mask in left.values()):
                break
            near.more(amount, truth, batch=batch)
            for stage, mask in left.items():
                like = self._like(stage, near, rows, columns)
                if strictly:
                    like &= ~self._steady(stage, near, rows, columns) | (self.ratio(stage)[rows, columns] <= SLACK)
                left[stage] = mask & ~like
        undecided = {stage: np.isnan(samples).any(axis=(0, 2)) for stage, samples in near.samples.items()}
        tied = {stage: self._lost(rows, columns) for stage in self.stages}
        if Stage.OBJECT in near.samples:
            # Whichever of several surfaces in one place it is, who sees none of them is wrong.
            decided = near.samples[Stage.OBJECT][..., 0]
            always = (decided >= 0).any(axis=0) & ~(decided < 0).any(axis=0)
            undecided[Stage.OBJECT] &= ~(always & (self.party.answers[Stage.OBJECT][rows, columns, 0] < 0))
        for stage in self.stages:
            for before in {stage, *LIT[stage]} & set(undecided):
                tied[stage] |= undecided[before]
        return left, tied

    def _lost(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return which pixels (n,) show a shape that the least rounding moves by half of its own size.

        The eye's place and the shape's are rounded, each to either side. Of what such a shape looks like no number of
        scenes shows everything, nor is a place on it one. The same holds of a body that is thinner than its surface's
        error across itself: which of its faces is met depends on how a matrix is inverted, and no scene shows that. A
        ray that runs within a face meets it anywhere.
        """
        scene = self.base.scene
        farthest = max(
            np.abs(place).max()
            for place in (scene.camera.eye, *(np.asarray(shape.to_world)[:3, 3] for shape in scene.shapes))
        )
        step = AMOUNTS[0] * UNIT_ROUNDOFF[self.party.precision] * farthest
        small = np.array([*(_size(shape) <= 4 * step for shape in scene.shapes), False])
        thin = np.array([*map(_thickness, scene.shapes), np.inf])
        found = self.base.conditioning.cosine[rows, columns] <= LEAST_COSINE
        for answers in (self.truth, self.party.answers):
            if Stage.OBJECT in answers:
                index = np.nan_to_num(np.asarray(answers[Stage.OBJECT])[rows, columns, 0], nan=-1.0)
                shape = np.where((index >= 0) & (index < len(scene.shapes)), index, -1).astype(int)
                found |= small[shape] | (thin[shape] <= self.against.limits.lifted[rows, columns])
        return found

    def _on_the_horizon(self, pixels: np.ndarray) -> np.ndarray:
        """Return which pixels (n, 2) see a light or not by how a triangle's corners are rounded to float32.

        Its normal is that of object space and its plane that of these corners. Between the horizons of the two a light
        is above one and below the other, whoever asks and however precisely.
        """
        if Stage.VISIBILITY not in self.stages:
            return np.zeros(len(pixels), dtype=bool)
        columns, rows = pixels.T
        found = self._between_horizons(rows, columns)
        for near in horizons(self.base.scene):
            seen = CERTIFIED.at(near, (Stage.OBJECT, Stage.VISIBILITY), pixels + 0.5, exactly=False)
            same = all_of(seen[Stage.OBJECT] == self.truth[Stage.OBJECT][rows, columns])
            found |= same & any_of(seen[Stage.VISIBILITY] != self.truth[Stage.VISIBILITY][rows, columns])
        return found

    def _between_horizons(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return which pixels (n,) show a triangle of whose normal and baked plane a light is on two sides."""
        scene, truth = self.base.scene, self.truth
        found = np.zeros(len(rows), dtype=bool)
        for pixel, (index, face) in enumerate(truth[Stage.OBJECT][rows, columns]):
            shape = scene.shapes[int(index)] if index >= 0 else None
            if isinstance(shape, Triangle | Mesh):
                corners = world_triangles(shape)[int(face)].astype(np.float64)
                plane, normal = np.cross(*np.diff(corners, axis=0)), truth[Stage.NORMAL][rows[pixel], columns[pixel]]
                ways = np.array([light.position for light in scene.lights])
                ways = ways - truth[Stage.POSITION][rows[pixel], columns[pixel]]
                found[pixel] = bool(((ways @ plane > 0) != (ways @ (normal * np.sign(plane @ normal)) > 0)).any())
        return found

    def _steady(self, stage: Stage, near: Nearby, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return where (n,) no trial changes what is seen, what lights it, or jumps to another side's value."""
        decisions = [one for one in (Stage.OBJECT, Stage.VISIBILITY) if one in near.samples and (one in LIT[stage])]
        same = [(near.samples[one] == near.samples[one][0]).all(axis=(0, 2)) for one in decisions]
        if Stage.VISIBILITY in decisions:
            same.append(~self._felt_otherwise(near.samples[Stage.VISIBILITY][0], rows, columns))
        values = near.samples[stage]
        with np.errstate(invalid="ignore"):
            span = np.nan_to_num(values.max(axis=0) - values.min(axis=0), nan=0.0).max(axis=1, initial=0.0)
        return all_of(np.stack([*same, span <= JUMP * self._bound(stage, rows, columns)], axis=-1))

    def _bound(self, stage: Stage, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the limit of pixels (n,), the largest nearby: at an edge it may be that of the other side."""
        limit = self.limit(stage)
        return widest_near(largest(limit) if limit.ndim == 3 else limit)[rows, columns]

    def _like(self, stage: Stage, near: Nearby, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return where (n,) the party's value is one that a scene within rounding has."""
        if stage is Stage.RAY:
            return np.zeros(len(rows), dtype=bool)
        ours = {name: np.asarray(self.party.answers[name])[rows, columns] for name in self.stages}
        same = np.ones(near.samples[stage].shape[:2], dtype=bool)
        if Stage.OBJECT in ours:
            same = all_of(near.samples[Stage.OBJECT] == ours[Stage.OBJECT])
        if stage is Stage.OBJECT:
            return np.logical_or.reduce(same, axis=0) | self._as_deep(ours[stage], rows, columns)
        theirs, value = near.samples[stage], ours[stage]
        if stage is Stage.VISIBILITY:
            among = ((theirs == value) & same[..., np.newaxis]).any(axis=0)
            return all_of(among | self._feels(ours, value, rows, columns))
        # The limit may be that of a miss, or of another surface: none is below sixteen roundings of what it has.
        least = Roundoff(self.party.precision)(HIT) * largest(np.abs(value))
        bound = np.maximum(self._bound(stage, rows, columns), np.where(np.isfinite(least), least, 0.0))[:, np.newaxis]
        if stage in LIGHT and Stage.VISIBILITY in ours:
            alike = same & all_of(near.samples[Stage.VISIBILITY] == ours[Stage.VISIBILITY])
            return _among(value, theirs, alike, bound) | self._follows(stage, ours, value, bound, rows, columns)
        like = _among(value, theirs, same, bound)
        return like | self._faces(ours, bound, rows, columns) if stage is Stage.NORMAL else like

    def _as_deep(self, objects: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return where (n,) what the party names is met as deep as what is seen: rounding says which of two is nearer.

        Seen from afar, a scene that is moved by as much shows the one that is turned away too seldom.
        """
        given = {Stage.RAY: self.base.truth[Stage.RAY][rows, columns], Stage.OBJECT: objects}
        with np.errstate(invalid="ignore"):
            apart = continued(self.base.scene, Stage.DISTANCE, given) - self.base.truth[Stage.DISTANCE][rows, columns]
        return np.abs(apart[:, 0]) <= self.limit(Stage.DISTANCE)[rows, columns]

    def _about(self, ours: dict[Stage, np.ndarray], heights: Iterable[np.ndarray]) -> Iterator[dict[Stage, np.ndarray]]:
        """Yield the answers with the hit that the party names moved by heights [m] along its normal, to either side.

        A hit is off its surface by rounding. No scene within rounding shows that: its hits are on their surfaces.
        """
        for height in heights:
            for side in (1.0, -1.0):
                start = ours[Stage.POSITION] + side * height[:, np.newaxis] * ours[Stage.NORMAL]
                yield ours | {Stage.POSITION: start}

    def _faces(self, ours: dict[Stage, np.ndarray], bound: np.ndarray, rows: np.ndarray, columns: np.ndarray):
        """Return where (n,) the party's normal is that of a point at its own hit: at a cube's edge, of either face."""
        found = np.zeros(len(rows), dtype=bool)
        if {Stage.OBJECT, Stage.POSITION, Stage.NORMAL} <= set(ours):
            lifted = self.against.limits.lifted[rows, columns]
            for about in self._about(ours, (0 * lifted, lifted)):
                expected = continued(self.base.scene, Stage.NORMAL, about)
                found |= all_of(np.abs(ours[Stage.NORMAL] - expected) <= bound)
        return found

    def _feels(self, ours: dict[Stage, np.ndarray], value: np.ndarray, rows: np.ndarray, columns: np.ndarray):
        """Return which lights (n, lights) are seen or not, as `value` says, from about the hit that the party names.

        Shadow rays start above it by what the party declares, as far as that is granted.
        """
        found = np.zeros(value.shape, dtype=bool)
        if not {Stage.OBJECT, Stage.POSITION, Stage.NORMAL} <= set(ours):
            return found
        lifted = self.against.limits.lifted[rows, columns]
        needed = needed_shadow(self.against)
        above = np.minimum(self.party.shadow_epsilon, self.granted * needed)
        heights = -lifted, 0 * lifted, lifted, lifted + above[rows, columns]
        for about in self._about(ours, heights):
            found |= continued(self.base.scene, Stage.VISIBILITY, about) == value
        return found

    def _felt_otherwise(self, seen: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return in which pixels (n,) the subject's shadow rays explain its visibility, but not that of the oracle."""
        ours = {name: np.asarray(self.party.answers[name])[rows, columns] for name in self.stages}
        if Stage.VISIBILITY not in ours:
            return np.zeros(len(rows), dtype=bool)
        return any_of((ours[Stage.VISIBILITY] != seen) & self._feels(ours, ours[Stage.VISIBILITY], rows, columns))

    def _follows(
        self,
        stage: Stage,
        ours: dict[Stage, np.ndarray],
        value: np.ndarray,
        bound: np.ndarray,
        rows: np.ndarray,
        columns: np.ndarray,
    ) -> np.ndarray:
        """Return where (n,) light follows from the party's own other side of an edge, by certified arithmetic."""
        before = [name for name in (*GEOMETRY, Stage.VISIBILITY) if name in self.stages]
        elsewhere = np.any([self.over[name][rows, columns] for name in before], axis=0)
        if not elsewhere.any() or not set(GEOMETRY) <= set(self.stages):
            return np.zeros(len(rows), dtype=bool)
        expected = continued(self.base.scene, stage, ours)
        # From a given position and normal light is known as well as the way to each light is.
        given = {name: image[:, np.newaxis] for name, image in ours.items()}
        arriving, g = continued(self.base.scene, Stage.IRRADIANCE, ours), Roundoff(self.party.precision)
        known = continued_light_limit(self.base.scene, Stage.IRRADIANCE, given, arriving, g)[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(arriving > 0, known / arriving, 0.0) + 64 * UNIT_ROUNDOFF[self.party.precision]
            slack = 2 * bound + share * np.abs(expected)
            close = (np.abs(value - expected) <= slack) | (value == expected)
        return elsewhere & all_of(close)


def _among(value: np.ndarray, theirs: np.ndarray, same: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Return where (n,) values lie in the range of the samples (k, n, channels) of the `same` object."""
    mask = same[..., np.newaxis]
    with np.errstate(invalid="ignore"):
        low = np.where(mask, theirs, np.inf).min(axis=0)
        high = np.where(mask, theirs, -np.inf).max(axis=0)
        span = np.where(np.isfinite(high - low), high - low, 0.0)
        inside = (value >= low - span - bound) & (value <= high + span + bound)
    return all_of(inside) & same.any(axis=0)


def _size(shape: Shape) -> float:
    """Return a shape's extent in the world [m], infinite of a plane."""
    linear = np.asarray(shape.to_world)[:3, :3]
    if isinstance(shape, Plane):
        return np.inf
    if isinstance(shape, Triangle | Mesh):
        corners = np.asarray(shape.vertices, dtype=np.float64) @ linear.T
        return float(np.linalg.norm(np.ptp(corners, axis=0)))
    unit = 2 * shape.radius if isinstance(shape, Sphere) else 1.0
    return float(unit * np.linalg.norm(linear, 2))


def _thickness(shape: Shape) -> float:
    """Return how thick a cube or a sphere is in the world [m], infinite of a shape that is a surface only."""
    if not isinstance(shape, Cube | Sphere):
        return np.inf
    unit = 2 * shape.radius if isinstance(shape, Sphere) else 1.0
    return float(unit * np.linalg.norm(np.asarray(shape.to_world)[:3, :3], -2))
