"""Which pixels over their limits are explained: by rounding, by a declared epsilon, or not at all.

Pixels in which nothing changes even `FARTHEST` units of roundoff away are left to their forward limits. The others are
asked in rounds. The first two move only the image points and the starts of shadow rays, all of them in one call of the
oracle. Then the scenes move as well, 18 and 72 of them, each with several points of a pixel. A pixel is asked on until
a problem explains it.
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

FIRST, SECOND = 8, 64  # draws of the rounds in which only points move
FAR = 16  # problems that are moved as far as `FARTHEST`
SMOOTH = 4  # times what the limits allow in proportion: several data that move at once change a value by less
ROUNDS = (6, 24)  # scenes of each amount in the rounds in which these move
POINTS = (8, 16)  # points of each pixel that are asked in each of these scenes
DRAWN = 7  # numbers for each point: two of its place, lift, epsilon, what that is, which horizon and twin, slide
MOST_ASKED = 400  # pixels that go on to the rounds in which scenes move: a wrong renderer is wrong in its first ones
HALVINGS = 40  # of the way from a pixel's centre to the object that a renderer names
AGAIN = 10  # times as many problems before a renderer is failed by few pixels
FEW = 16  # pixels


@dataclass(frozen=True, kw_only=True)
class DecisionReach:
    """How far rounding, and what a renderer declares, move what decides about single pixels, (height, width)."""

    image: np.ndarray  # px: the ray's own forward limit
    lift: np.ndarray  # m: a hit's own error across its surface
    tie: np.ndarray  # m: how much farther coinciding surfaces may lie


@dataclass(frozen=True, kw_only=True)
class Declared:
    """What a renderer declares that it overlooks or takes for equal; nothing by default."""

    shadow: np.ndarray | float = 0.0  # m, (height, width) or one for all: at the start of a shadow ray
    ray: float = 0.0  # m: hits nearer to the eye
    light: float = 0.0  # of a shadow ray's length: blockers nearer to the light
    edge: np.ndarray | float = 0.0  # px, (height, width): how far beyond an edge points may be taken for inside
    tie: float = 0.0  # m: surfaces no farther apart along a ray
    edge_length: float = 0.0  # m: the same as `edge`, by which a position there may be off

    def __bool__(self) -> bool:
        """Return whether anything is declared."""
        return any(np.any(value) for value in (self.shadow, self.ray, self.light, self.edge, self.tie))


NOTHING = Declared()


AllowedAt = Callable[[np.ndarray, np.ndarray, Mapping[Stage, np.ndarray]], Allowed]


@dataclass(eq=False)
class Asking:
    """One renderer's values at pixels over their limits, put to the oracle's answers to nearby problems."""

    oracle: Analytic
    problems: Problems
    stages: Sequence[Stage]  # that the oracle answers
    answers: StageImages  # the renderer's, (height, width, channels)
    over: Mapping[Stage, np.ndarray]  # (height, width): the pixels over their limits
    reach: DecisionReach
    declared: Declared
    allowed: AllowedAt  # of pixels' (rows, columns), and of an answer's rows (n, channels)
    chained: bool = True  # light was computed of the very hits that the renderer names, not by a pass of its own
    clouds: list[tuple[Cloud, np.ndarray, np.ndarray]] = field(default_factory=list)  # kept where `keep` says so
    keep: bool = False

    def __post_init__(self) -> None:
        self._left = {stage: mask.copy() for stage, mask in self.over.items() if stage is not Stage.RAY and mask.any()}
        self._found = {
            stage: Explained(**{name: np.zeros_like(mask) for name in ("rounding", "epsilon", "unexamined")})
            for stage, mask in self.over.items()
        }

    @property
    def scene(self) -> Scene:
        """Return the scene asked about."""
        return self.problems.scene

    @property
    def last(self) -> Stage:
        """Return the last stage in question."""
        asked = max(self._left, key=IMAGE_STAGES.index)
        return asked if IMAGE_STAGES.index(asked) >= IMAGE_STAGES.index(Stage.NORMAL) else Stage.NORMAL

    @cached_property
    def objects(self) -> np.ndarray | None:
        """Return the objects (height, width, 2) that the renderer names, None where it names none."""
        return self.answers.get(Stage.OBJECT)

    def explain(self) -> Mapping[Stage, Explained]:
        """Return what became of the pixels of each stage."""
        if not self._left:
            return self._found
        if self._lost():
            return self._found
        decided: dict[Stage, np.ndarray] = {}
        waiting = np.ones_like(self.reach.image, dtype=bool)
        while (asked := self._sample(waiting)).any():
            settled = self._settled(asked)
            self._ask_itself(waiting & ~settled, FIRST)
            # A stage that is wrong in a settled pixel is wrong; its others are asked no more.
            self._decide(settled, decided)
            self._ask(asked & ~settled)
            # If one of a stage's pixels that were asked is wrong, those that were not asked count as wrong as well.
            self._decide(asked, decided)
            waiting &= ~asked
        self._left |= decided
        return self._found

    def _decide(self, pixels: np.ndarray, decided: dict[Stage, np.ndarray]) -> None:
        """Move the stages that are left in some of the pixels (height, width) to those that are decided."""
        for stage in [stage for stage, mask in self._left.items() if (mask & pixels).any()]:
            decided[stage] = self._left.pop(stage)

    def _ask(self, moving: np.ndarray) -> None:
        """Ask pixels (height, width) of the rounds, up to the last that are left."""
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
        """Ask the few pixels that are left of ten times as many problems, and of an oracle that decides exactly."""
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
        """Return the pixels that nothing has explained so far."""
        return self._left

    def reach_of(self, stage: Stage, truth: StageImages) -> np.ndarray:
        """Return how far the answers of nearby problems lie from the oracle's own, (height, width, channels).

        By the first round, and by problems whose scenes move.
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
        """Leave everything unexamined where rounding turns rays by more than the image is large."""
        lost = self.reach.image > sum(self.reach.image.shape)
        if lost.any():
            for stage, mask in self._left.items():
                self._found[stage].unexamined[mask & lost] = True
                mask &= ~lost
        return not any(mask.any() for mask in self._left.values())

    def _ask_itself(self, where: np.ndarray, times: int) -> None:
        """Ask pixels of the scene itself, with so many points of each moved, in one call of the oracle."""
        for declared, kind in ((NOTHING, "rounding"), (self.declared, "epsilon")):
            pixels = self._pixels(where)
            if len(pixels[0]) and (declared or kind == "rounding"):
                self._judge(pixels, self._of_itself(*pixels, declared, times), self._found, kind, declared)

    def _settled(self, asked: np.ndarray) -> np.ndarray:
        """Return those of some pixels (height, width) that show the same even far away, so that their limits decide.

        What changes by no more than in proportion to how far the problem is, is a matter of the limits.
        """
        settled = self._unchanged(asked, [replace(self.problems.itself(), amount=FARTHEST)], times=FIRST)
        if settled.any():
            problems = [self.problems.moved(FARTHEST, number) for number in range(FAR)]
            settled = self._unchanged(settled, [problem for problem in problems if problem is not None])
        return settled

    def _unchanged(self, asked: np.ndarray, problems: Sequence[Problem], *, times: int = 1) -> np.ndarray:
        """Return those of some pixels (height, width) that show the same piece and lights in all of some problems."""
        unchanged = np.zeros_like(asked)
        rows, columns = pixels = self._pixels(asked)
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
        """Return which pixels of `where` are asked next: at most `MOST_ASKED`, the same ones in every image."""
        waiting = _mask(where.shape, self._pixels(where))
        if np.count_nonzero(waiting) <= MOST_ASKED:
            return waiting
        order = np.where(waiting, np.random.default_rng(self.problems.seed).random(waiting.shape), np.inf)
        return order <= np.partition(order.ravel(), MOST_ASKED - 1)[MOST_ASKED - 1]

    def _put_to(self, pixels: tuple[np.ndarray, np.ndarray], problems: Sequence[Problem], *, times: int = 1) -> None:
        """Ask pixels of problems whose scenes move, of directed draws, and at last with what the renderer declares."""
        for declared, kind in ((NOTHING, "rounding"), (self.declared, "epsilon")):
            left = self._pixels(_mask(self.reach.image.shape, pixels))
            if not len(left[0]) or (kind == "epsilon" and not declared):
                return
            cloud = self._cloud(left, problems, declared, times=times)
            more = [cloud, *self._directed(left, cloud)]
            self._judge(left, joined(more), self._found, kind, declared)

    def _pixels(self, where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and columns of the pixels of `where` that are left."""
        left = np.zeros_like(where)
        for mask in self._left.values():
            left |= mask & where
        rows, columns = np.nonzero(left)
        return rows, columns

    # Answers.

    def _of_itself(self, rows: np.ndarray, columns: np.ndarray, declared: Declared, times: int = FIRST) -> Cloud:
        """Return the scene's own answers at the centre and at points around it, in one call of the oracle."""
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
        """Return the oracle's answers to problems at pixels, each at so many points of every pixel.

        In one of `every_tie` problems coinciding surfaces come in another order.
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
        """Return the oracle's answers at pixels' centres, with nothing moved."""
        return split(self.oracle.samples(self.scene, _centers(*pixels), self.last), 1)

    def _points(
        self, rows: np.ndarray, columns: np.ndarray, problem: Problem, declared: Declared, *, times: int = 1
    ) -> tuple[np.ndarray, Freedom]:
        """Return where rays go in a problem, (times n, 2) [px], and what it leaves open at its points.

        What is drawn for a pixel does not depend on which others are asked.
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
        skips = half[:, 1] < 1 / 3  # a renderer moves the start or skips blockers near it; nobody says which
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
        """Return the objects (n, 2) that are hit where several coincide; of light by another pass, not `always` (n,).

        Such a pass may have met another of them than the one that is named.
        """
        if self.objects is None:
            return None
        objects = np.asarray(self.objects[rows, columns], dtype=np.float64)
        return objects if self.chained else np.where(always[:, np.newaxis], objects, NOWHERE)

    def _directed(self, pixels: tuple[np.ndarray, np.ndarray], cloud: Cloud, *, by_light: bool = True) -> list[Cloud]:
        """Return answers on the way from pixels' centres to the objects that the renderer names and no problem hit.

        Between many thin faces no draw at random meets a given one. The way is halved, so that however narrow the face
        is at the pixel, some of the points lie on it; those within the ray's reach count.
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
        known = np.isfinite(size) & (size > 0)
        if not known.any():
            return []
        share = np.where(known, np.minimum(reach / np.where(known, size, 1.0), 1.0), 0.0)
        points = np.repeat(centers[np.newaxis], HALVINGS, axis=0)
        steps = (0.5 ** np.arange(HALVINGS))[:, np.newaxis, np.newaxis]
        points[:, missed] += steps * (share[:, np.newaxis] * np.where(known[:, np.newaxis], way, 0.0))
        samples = self.oracle.samples(self.scene, points.reshape(-1, 2), self.last, by_light=by_light)
        return [split(samples, HALVINGS)]

    # Judging.

    def _judge(
        self,
        pixels: tuple[np.ndarray, np.ndarray],
        cloud: Cloud,
        found: Mapping[Stage, Explained],
        kind: str,
        declared: Declared = NOTHING,
    ) -> None:
        """Take the pixels that some answer explains off those that are left."""
        rows, columns = pixels
        if self.keep:
            self.clouds.append((cloud, rows, columns))
        waiting = {stage: mask[rows, columns] for stage, mask in self._left.items()}
        named = cloud.named(None if self.objects is None else self.objects[rows, columns])
        lit = named if self.chained else np.ones_like(named)
        good = {stage: np.zeros(len(rows), dtype=bool) for stage in waiting}
        spanned = {stage: np.zeros(len(rows), dtype=bool) for stage in waiting}
        for stage, asked in waiting.items():
            values = self._values(stage, rows, columns)
            if stage is Stage.OBJECT:
                good[stage] = asked & named.any(axis=0)
            elif stage is Stage.VISIBILITY:
                agree = cloud.rows[stage] == values
                good[stage] = asked & all_of((agree & lit[..., np.newaxis]).any(axis=0))
        for counting, stages in ((named, SURFACE), (lit, LIGHT)):
            by_piece = [stage for stage in waiting if stage in stages and waiting[stage].any()]
            if by_piece:
                self._judge_by_piece(by_piece, (rows, columns), cloud, counting, waiting, good, spanned, declared)
        for stage in waiting:
            where = rows[good[stage]], columns[good[stage]]
            getattr(found[stage], kind)[where] = True
            between = spanned[stage] & ~good[stage]
            found[stage].unexamined[rows[between], columns[between]] = True
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
        """Add to `good` and `spanned` (n,) what the answers that count (K, n) say of some stages, piece by piece."""
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
                some = np.flatnonzero(ask)
                values = self._values(stage, rows[places[some]], columns[places[some]])
                arguments = stage, values, here.at(some), answers[:, some], _allowed_at(allowed, some, declared)
                if stage in SURFACE:
                    good[stage][places[some]] = is_of_surface(*arguments)
                else:
                    explained, between = is_of_lights(*arguments)
                    good[stage][places[some]] = explained
                    spanned[stage][places[some]] |= between
            wanted &= np.any([waiting[stage] & ~good[stage] for stage in by_piece], axis=0)

    def _values(self, stage: Stage, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        return np.asarray(self.answers[stage][rows, columns], dtype=np.float64)


def _allowed_at(allowed: Allowed, places: np.ndarray, declared: Declared) -> Allowed:
    """Return limits at some of the pixels, wider by the length by which a declared epsilon moves a hit."""
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
