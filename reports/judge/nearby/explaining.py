"""Explanations of pixels over their limits: by rounding, by a declared epsilon, or none.

Pixels without a change in problems as far as `FARTHEST` units of roundoff are decided by their forward limits.
The others are compared with nearby problems in rounds. The first two rounds move only the image points and the starts
of shadow rays, all in one call of the oracle. The next rounds move the scenes as well, 18 and 72 of them, each with
several points per pixel. A pixel takes part until a problem explains it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import NOWHERE, Analytic, Freedom
from rayproof.reports.judge.answers import all_of
from rayproof.reports.judge.measurement import Explained
from rayproof.reports.judge.nearby.clouds import (
    LIGHT,
    SURFACE,
    Allowed,
    Cloud,
    is_of_lights,
    is_of_surface,
    joined,
    one_of,
    split,
)
from rayproof.reports.judge.nearby.exact import ExactOracle
from rayproof.reports.judge.nearby.problems import AMOUNTS, COINCIDING, EVERY_TIE, FARTHEST, Problem, Problems

FIRST, SECOND = 8, 64  # draws of the rounds that move only points
FAR = 16  # problems that are moved by `FARTHEST`
SMOOTH = 4  # factor on the scaled limits: several data that move at once change a value by less than that
ROUNDS = (6, 24)  # scenes per amount in the rounds that move scenes
POINTS = (8, 16)  # points per pixel in each of these scenes
DRAWN = 7  # random numbers per point: two for its position, lift, epsilon's kind and size, horizon and object, slide
MOST_ASKED = 400  # pixels that take part in the rounds that move scenes: a wrong renderer fails in the first of them
HALVINGS = 40  # of the line from a pixel's centre to the object that a renderer names
AGAIN = 10  # factor on the number of problems if only a few pixels would fail a renderer
FEW = 16  # such pixels


@dataclass(frozen=True, kw_only=True)
class DecisionReach:
    """How far rounding moves the quantities that decide single pixels, (height, width)."""

    image: np.ndarray  # px: the forward limit of the ray
    lift: np.ndarray  # m: the error of a hit along its normal
    tie: np.ndarray  # m: the largest distance of surfaces that count as coinciding


@dataclass(frozen=True, kw_only=True)
class Declared:
    """The declared epsilons of a renderer, within which it ignores hits or treats them as equal; 0 by default."""

    shadow: np.ndarray | float = 0.0  # m, (height, width) or a scalar: ignored at the start of a shadow ray
    ray: float = 0.0  # m: hits nearer to the eye are ignored
    light: float = 0.0  # share of a shadow ray's length; blockers nearer to the light than this are ignored
    edge: np.ndarray | float = 0.0  # px, (height, width): points this far beyond an edge may count as inside
    tie: float = 0.0  # m: surfaces no farther apart along a ray count as equal
    edge_length: float = 0.0  # m: `edge` as a length, the possible error of a position there

    def __bool__(self) -> bool:
        """Return whether anything is declared."""
        return any(np.any(value) for value in (self.shadow, self.ray, self.light, self.edge, self.tie))


NOTHING = Declared()


AllowedAt = Callable[[np.ndarray, np.ndarray, Mapping[Stage, np.ndarray]], Allowed]


@dataclass(eq=False)
class Asking:
    """Compare a renderer's values at pixels over their limits with the oracle's answers to nearby problems."""

    oracle: Analytic
    problems: Problems
    stages: Sequence[Stage]  # with an answer of the oracle
    answers: StageImages  # the renderer's, (height, width, channels)
    over: Mapping[Stage, np.ndarray]  # (height, width): the pixels over their limits
    reach: DecisionReach
    declared: Declared
    allowed: AllowedAt  # limits at pixels (rows, columns) for an answer's rows (n, channels)
    chained: bool = True  # light was computed at the hits that the renderer names, not in a separate pass
    clouds: list[tuple[Cloud, np.ndarray, np.ndarray]] = field(default_factory=list)  # stored if `keep`
    keep: bool = False

    def __post_init__(self) -> None:
        self._left = {stage: mask.copy() for stage, mask in self.over.items() if stage is not Stage.RAY and mask.any()}
        self._found = {
            stage: Explained(**{name: np.zeros_like(mask) for name in ("rounding", "epsilon", "unexamined")})
            for stage, mask in self.over.items()
        }

    @property
    def scene(self) -> Scene:
        """Return the scene of the problems."""
        return self.problems.scene

    @property
    def last(self) -> Stage:
        """Return the last stage that the oracle must compute."""
        latest = max(self._left, key=IMAGE_STAGES.index)
        return latest if IMAGE_STAGES.index(latest) >= IMAGE_STAGES.index(Stage.NORMAL) else Stage.NORMAL

    @cached_property
    def objects(self) -> np.ndarray | None:
        """Return the objects (height, width, 2) that the renderer names, None without an object stage."""
        return self.answers.get(Stage.OBJECT)

    def explain(self) -> Mapping[Stage, Explained]:
        """Return the explanations of the pixels of each stage."""
        if not self._left:
            return self._found
        if self._lost():
            return self._found
        decided: dict[Stage, np.ndarray] = {}
        waiting = np.ones_like(self.reach.image, dtype=bool)
        while (sample := self._sample(waiting)).any():
            settled = self._settled(sample)
            self._ask_itself(waiting & ~settled, FIRST)
            # A stage that is wrong in a settled pixel is wrong; its other pixels need no examination.
            self._decide(settled, decided)
            self._ask(sample & ~settled)
            # If any examined pixel of a stage is wrong, its pixels that were not examined count as wrong as well.
            self._decide(sample, decided)
            waiting &= ~sample
        self._left |= decided
        return self._found

    def _decide(self, pixels: np.ndarray, decided: dict[Stage, np.ndarray]) -> None:
        """Move the stages with unexplained pixels in the mask `pixels` (height, width) to `decided`."""
        for stage in [stage for stage, mask in self._left.items() if (mask & pixels).any()]:
            decided[stage] = self._left.pop(stage)

    def _ask(self, moving: np.ndarray) -> None:
        """Examine pixels (height, width) in all rounds, until none is left."""
        self._ask_itself(moving, SECOND)
        for number, (more, times) in enumerate(zip(ROUNDS, POINTS, strict=True)):
            pixels = self._pixels(moving)
            if not len(pixels[0]):
                return
            start = sum(ROUNDS[:number])
            problems = list(self.problems.within(range(start, start + more)))
            if number == 0 and (read := self.problems.as_read()) is not None:
                problems.insert(0, read)
            self._put_to(pixels, problems, times=times)
        if 0 < len(self._pixels(moving)[0]) <= FEW:
            self._ask_again(moving)

    def _ask_again(self, moving: np.ndarray) -> None:
        """Examine the few remaining pixels with ten times as many problems, then with the exact oracle."""
        pixels = self._pixels(moving)
        start = sum(ROUNDS)
        for number in range(start, start + AGAIN * ROUNDS[0], ROUNDS[0]):
            if not len(pixels[0]):
                return
            problems = list(self.problems.within(range(number, number + ROUNDS[0])))
            self._put_to(pixels, problems, times=AGAIN * POINTS[0])
            pixels = self._pixels(moving)
        if len(pixels[0]):
            self.oracle = ExactOracle()
            self._put_to(pixels, [self.problems.itself(), *self.problems.within(range(ROUNDS[0]))])

    @property
    def left(self) -> Mapping[Stage, np.ndarray]:
        """Return the pixels that are not explained so far."""
        return self._left

    def reach_of(self, stage: Stage, truth: StageImages) -> np.ndarray:
        """Return the largest difference of nearby problems from the oracle's answer, (height, width, channels).

        The problems are those of the first round and some whose scenes move.
        """
        off = np.zeros(np.shape(truth[stage]))
        rows, columns = pixels = self._pixels(np.ones_like(self.reach.image, dtype=bool))
        if len(rows):
            problems = list(self.problems.within(range(1)))
            clouds = [self._of_itself(rows, columns, self.declared), self._cloud(pixels, problems, self.declared)]
            values = joined(clouds).rows[stage]
            own = truth[stage][rows, columns]
            with np.errstate(invalid="ignore"):  # an infinite value of both is no difference
                apart = np.where(values == own, 0.0, np.abs(values - own))
            off[rows, columns] = apart.max(axis=0)
        return off

    # Rounds.

    def _lost(self) -> bool:
        """Mark pixels as unexamined whose rays rounding turns by more than the image; return whether none is left."""
        lost = self.reach.image > sum(self.reach.image.shape)
        if lost.any():
            for stage, mask in self._left.items():
                self._found[stage].unexamined[mask & lost] = True
                mask &= ~lost
        return not any(mask.any() for mask in self._left.values())

    def _ask_itself(self, where: np.ndarray, times: int) -> None:
        """Examine pixels with `times` moved points each in the unmoved scene, in one call of the oracle."""
        for declared, kind in ((NOTHING, "rounding"), (self.declared, "epsilon")):
            pixels = self._pixels(where)
            if len(pixels[0]) and (declared or kind == "rounding"):
                self._judge(pixels, self._of_itself(*pixels, declared, times), self._found, kind, declared)

    def _settled(self, candidates: np.ndarray) -> np.ndarray:
        """Return the pixels of `candidates` (height, width) without changes in far problems: their limits decide.

        A change in proportion to the distance of the problem is covered by the limits.
        """
        settled = self._unchanged(candidates, [replace(self.problems.itself(), amount=FARTHEST)], times=FIRST)
        if settled.any():
            problems = [self.problems.moved(FARTHEST, number) for number in range(FAR)]
            settled = self._unchanged(settled, [problem for problem in problems if problem is not None])
        return settled

    def _unchanged(self, candidates: np.ndarray, problems: Sequence[Problem], *, times: int = 1) -> np.ndarray:
        """Return the pixels of `candidates` (height, width) that show the same piece and lights in all problems."""
        unchanged = np.zeros_like(candidates)
        rows, columns = pixels = self._pixels(candidates)
        if not len(rows) or not problems:
            return unchanged
        cloud = self._cloud(pixels, problems, self.declared, times=times, every_tie=1, by_light=False)
        cloud = joined([cloud, *self._directed(pixels, cloud, by_light=False)])
        center = self._centre(pixels)
        changes = (cloud.codes != center.codes).any(axis=0)
        if Stage.VISIBILITY in cloud.rows:
            changes |= (cloud.rows[Stage.VISIBILITY] != center.rows[Stage.VISIBILITY]).any(axis=(0, 2))
        allowed = self.allowed(rows, columns, {stage: image[0] for stage, image in center.rows.items()})
        for stage in SURFACE:
            with np.errstate(invalid="ignore"):
                off = np.nan_to_num(np.abs(cloud.rows[stage] - center.rows[stage]), nan=0.0, posinf=np.inf)
            changes |= ~(off <= SMOOTH * FARTHEST / AMOUNTS[-1] * allowed.at(stage)).all(axis=(0, 2))
        unchanged[rows[~changes], columns[~changes]] = True
        return unchanged

    def _sample(self, where: np.ndarray) -> np.ndarray:
        """Return the pixels of `where` to examine next: at most `MOST_ASKED`, the same ones in every image."""
        waiting = _mask(where.shape, self._pixels(where))
        if np.count_nonzero(waiting) <= MOST_ASKED:
            return waiting
        order = np.where(waiting, np.random.default_rng(self.problems.seed).random(waiting.shape), np.inf)
        return order <= np.partition(order.ravel(), MOST_ASKED - 1)[MOST_ASKED - 1]

    def _put_to(self, pixels: tuple[np.ndarray, np.ndarray], problems: Sequence[Problem], *, times: int = 1) -> None:
        """Examine pixels with problems whose scenes move and with directed draws, and again with declared epsilons."""
        for declared, kind in ((NOTHING, "rounding"), (self.declared, "epsilon")):
            left = self._pixels(_mask(self.reach.image.shape, pixels))
            if not len(left[0]) or (kind == "epsilon" and not declared):
                return
            cloud = self._cloud(left, problems, declared, times=times)
            more = [cloud, *self._directed(left, cloud)]
            self._judge(left, joined(more), self._found, kind, declared)

    def _pixels(self, where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and columns of the pixels of `where` that are not explained so far."""
        left = np.zeros_like(where)
        for mask in self._left.values():
            left |= mask & where
        rows, columns = np.nonzero(left)
        return rows, columns

    # Answers.

    def _of_itself(self, rows: np.ndarray, columns: np.ndarray, declared: Declared, times: int = FIRST) -> Cloud:
        """Return the answers of the unmoved scene at the centre and at points around it, in one call of the oracle."""
        points, freedom = self._points(rows, columns, self.problems.itself(times), declared, times=times)
        still = np.zeros(len(rows))
        ties = np.arange(times) % EVERY_TIE == EVERY_TIE - 1
        freedom = replace(
            freedom,
            lift=np.concatenate([still, freedom.lift]),
            tie=np.concatenate([still, freedom.tie * np.repeat(ties, len(rows))]),
            blind=np.concatenate([still, freedom.blind]),
            slide=np.concatenate([still, freedom.slide]),
            plane=np.concatenate([still > 0, freedom.plane]),
            named=None if freedom.named is None else np.concatenate([freedom.named[: len(rows)], freedom.named]),
        )
        points = np.concatenate([_centers(rows, columns), points])
        return split(self.oracle.samples(self.scene, points, self.last, freedom, by_light=True), 1 + times)

    def _cloud(
        self,
        pixels: tuple[np.ndarray, np.ndarray],
        problems: Sequence[Problem],
        declared: Declared,
        *,
        times: int = 1,
        every_tie: int = EVERY_TIE,
        by_light: bool = True,
    ) -> Cloud:
        """Return the oracle's answers to problems at `times` points of each pixel.

        In every `every_tie`-th problem coinciding surfaces are in a different order.
        """
        clouds = []
        for number, problem in enumerate(problems):
            points, freedom = self._points(*pixels, problem, declared, times=times)
            if number % every_tie != every_tie - 1:
                freedom = replace(freedom, tie=0.0)
            samples = self.oracle.samples(problem.scene, points, self.last, freedom, by_light=by_light)
            clouds.append(split(samples, times))
        return joined(clouds)

    def _centre(self, pixels: tuple[np.ndarray, np.ndarray]) -> Cloud:
        """Return the oracle's answers at pixels' centres in the unmoved scene."""
        return split(self.oracle.samples(self.scene, _centers(*pixels), self.last), 1)

    def _points(
        self, rows: np.ndarray, columns: np.ndarray, problem: Problem, declared: Declared, *, times: int = 1
    ) -> tuple[np.ndarray, Freedom]:
        """Return the image points of a problem, (times n, 2) [px], and the freedom of its answers at these points.

        The random numbers of a pixel do not depend on the other pixels.
        """
        shape = self.reach.image.shape
        drawn = problem.drawn(rows * shape[1] + columns, times * DRAWN).reshape(-1, times, DRAWN)
        drawn = drawn.swapaxes(0, 1).reshape(-1, DRAWN)
        rows, columns = np.tile(rows, times), np.tile(columns, times)
        share = problem.amount / AMOUNTS[-1]
        reach = (self.reach.image + declared.edge)[rows, columns] * share
        half = np.abs(drawn[:, 2:])
        lift = self.reach.lift[rows, columns] * half[:, 0] * share
        shadow = np.broadcast_to(declared.shadow, shape)[rows, columns] * half[:, 2] * max(1.0, share)
        skips = half[:, 1] < 1 / 3  # a renderer moves the start or skips blockers near it; it does not declare which
        return _centers(rows, columns) + reach[:, np.newaxis] * drawn[:, :2], Freedom(
            lift=lift + np.where(skips, 0.0, shadow),
            tie=COINCIDING * self.reach.tie[rows, columns] + declared.tie,
            named=self._named(rows, columns, drawn[:, 5] > 0),
            near=declared.ray,
            blind=np.where(skips, shadow, 0.0),
            light=declared.light,
            slide=self.reach.tie[rows, columns] * drawn[:, 6] * share,
            plane=half[:, 3] < 1 / 2,
            draw=problem.draw,
        )

    def _named(self, rows: np.ndarray, columns: np.ndarray, always: np.ndarray) -> np.ndarray | None:
        """Return the objects (n, 2) that are hit among coinciding ones: those that the renderer names.

        If light was computed in a separate pass, which may have hit another of them, they are named only where `always`
        (n,) is set.
        """
        if self.objects is None:
            return None
        objects = np.asarray(self.objects[rows, columns], dtype=np.float64)
        return objects if self.chained else np.where(always[:, np.newaxis], objects, NOWHERE)

    def _directed(self, pixels: tuple[np.ndarray, np.ndarray], cloud: Cloud, *, by_light: bool = True) -> list[Cloud]:
        """Return answers on lines from pixels' centres to the objects that the renderer names and no problem hit.

        Random draws rarely hit a particular one of many thin faces. The line is halved repeatedly, so that some of the
        points are on the face, however narrow it is at the pixel. Points beyond the ray's reach are moved into it.
        """
        if self.objects is None:
            return []
        rows, columns = pixels
        objects = self.objects[rows, columns]
        missed = np.flatnonzero(~cloud.named(objects).any(axis=0))
        if not len(missed):
            return []
        centers = _centers(rows, columns)
        with np.errstate(invalid="ignore"):
            way = self.oracle.image_points_of(self.scene, objects[missed]) - centers[missed]
            size = np.abs(way).max(axis=1)
        reach = self.reach.image[rows, columns][missed]
        finite = np.isfinite(size) & (size > 0)
        if not finite.any():
            return []
        share = np.where(finite, np.minimum(reach / np.where(finite, size, 1.0), 1.0), 0.0)
        points = np.repeat(centers[np.newaxis], HALVINGS, axis=0)
        steps = (0.5 ** np.arange(HALVINGS))[:, np.newaxis, np.newaxis]
        points[:, missed] += steps * (share[:, np.newaxis] * np.where(finite[:, np.newaxis], way, 0.0))
        samples = self.oracle.samples(self.scene, points.reshape(-1, 2), self.last, by_light=by_light)
        return [split(samples, HALVINGS)]

    # Judging.

    def _judge(
        self,
        pixels: tuple[np.ndarray, np.ndarray],
        cloud: Cloud,
        explained: Mapping[Stage, Explained],
        kind: str,
        declared: Declared = NOTHING,
    ) -> None:
        """Record the pixels that some answer explains, and remove them from the unexplained ones."""
        rows, columns = pixels
        if self.keep:
            self.clouds.append((cloud, rows, columns))
        waiting = {stage: mask[rows, columns] for stage, mask in self._left.items()}
        named = cloud.named(None if self.objects is None else self.objects[rows, columns])
        lit = named if self.chained else np.ones_like(named)
        good = {stage: np.zeros(len(rows), dtype=bool) for stage in waiting}
        spanned = {stage: np.zeros(len(rows), dtype=bool) for stage in waiting}
        for stage, unexplained in waiting.items():
            values = self._values(stage, rows, columns)
            if stage is Stage.OBJECT:
                good[stage] = unexplained & named.any(axis=0)
            elif stage is Stage.VISIBILITY:
                agree = cloud.rows[stage] == values
                good[stage] = unexplained & all_of((agree & lit[..., np.newaxis]).any(axis=0))
        for counting, stages in ((named, SURFACE), (lit, LIGHT)):
            by_piece = [stage for stage in waiting if stage in stages and waiting[stage].any()]
            if by_piece:
                self._judge_by_piece(by_piece, (rows, columns), cloud, counting, waiting, good, spanned, declared)
        for stage in waiting:
            where = rows[good[stage]], columns[good[stage]]
            getattr(explained[stage], kind)[where] = True
            between = spanned[stage] & ~good[stage]
            explained[stage].unexamined[rows[between], columns[between]] = True
            self._left[stage][where] = False
            self._left[stage][rows[between], columns[between]] = False

    def _judge_by_piece(
        self,
        by_piece: Sequence[Stage],
        pixels: tuple[np.ndarray, np.ndarray],
        cloud: Cloud,
        counting: np.ndarray,
        waiting: Mapping[Stage, np.ndarray],
        good: Mapping[Stage, np.ndarray],
        spanned: Mapping[Stage, np.ndarray],
        declared: Declared,
    ) -> None:
        """Set `good` and `spanned` (n,) for the stages `by_piece`, per piece, from the answers in `counting` (K, n)."""
        rows, columns = pixels
        wanted = np.any([waiting[stage] for stage in by_piece], axis=0)
        for places, answers in cloud.pieces(counting, wanted):
            here = cloud.at(places)
            rep = {stage: one_of(image, answers) for stage, image in here.rows.items()}
            allowed = self.allowed(rows[places], columns[places], rep)
            for stage in by_piece:
                ask = waiting[stage][places] & ~good[stage][places]
                if not ask.any():
                    continue
                indices = np.flatnonzero(ask)
                values = self._values(stage, rows[places[indices]], columns[places[indices]])
                arguments = (
                    stage,
                    values,
                    here.at(indices),
                    answers[:, indices],
                    _allowed_at(allowed, indices, declared),
                )
                if stage in SURFACE:
                    good[stage][places[indices]] = is_of_surface(*arguments)
                else:
                    explained, between = is_of_lights(*arguments)
                    good[stage][places[indices]] = explained
                    spanned[stage][places[indices]] |= between
            wanted &= np.any([waiting[stage] & ~good[stage] for stage in by_piece], axis=0)

    def _values(self, stage: Stage, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        return np.asarray(self.answers[stage][rows, columns], dtype=np.float64)


def _allowed_at(allowed: Allowed, places: np.ndarray, declared: Declared) -> Allowed:
    """Return the limits at `places`, widened by the distance that a declared epsilon moves a hit."""
    off = declared.edge_length + declared.tie
    limits = {stage: np.asarray(limit)[places] for stage, limit in allowed.limits.items()}
    for stage in (Stage.DISTANCE, Stage.POSITION):
        if off:
            limits[stage] = limits[stage] + off
    return Allowed(
        limits=limits,
        lights=None if allowed.lights is None else allowed.lights[places],
        relative=None if allowed.relative is None else allowed.relative[places],
        roundings=allowed.roundings,
        steps={stage: np.asarray(step)[places] for stage, step in allowed.steps.items()},
    )


def _centers(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the image points (n, 2) [px] of pixels' centres."""
    return np.stack([columns + 0.5, rows + 0.5], axis=1)


def _mask(shape: tuple[int, ...], pixels: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    where = np.zeros(shape, dtype=bool)
    where[pixels] = True
    return where
