"""Explanations of the pixels of a continued stage: the oracle continues from the renderer's stages, moved by rounding.

The numbers of the renderer's stages are moved by up to 2, 8 and 16 times the sizes in this table; u is the unit
roundoff of its precision.

    ray, normal                        u, each component
    distance                           u times itself
    position                           u (|eye| + distance), but never below its own surface
    irradiance, exitance               u times themselves
    object, visibility                 nothing: they are whole numbers

If all these problems show the same piece, hit or miss and side as the oracle's answer to the unmoved numbers, only the
forward limit applies. An output that is coarser than its arithmetic moves the numbers by its own step. If stages were
computed in separate passes (`chained: false`), each is moved by its own end-to-end limit as well. The scene moves as
for stages end to end, and for visibility the start of shadow rays moves too.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic, Freedom
from rayproof.reports.judge.answers import all_of, dot
from rayproof.reports.judge.measurement import Explained
from rayproof.reports.judge.nearby.explaining import FIRST, HALVINGS, NOTHING, ROUNDS, DecisionReach, Declared
from rayproof.reports.judge.nearby.problems import AMOUNTS, FARTHEST, Problem, Problems

COUNT = 16  # numbers drawn per pixel: more than its stages have, and four for shadow rays
MOVING = 2  # rounds that move scenes
READ_BY: Mapping[Stage, tuple[Stage, ...]] = {
    Stage.OBJECT: (Stage.RAY,),
    Stage.DISTANCE: (Stage.RAY, Stage.OBJECT),
    Stage.POSITION: (Stage.RAY, Stage.OBJECT, Stage.DISTANCE),
    Stage.NORMAL: (Stage.RAY, Stage.OBJECT, Stage.POSITION),
    Stage.VISIBILITY: (Stage.OBJECT, Stage.POSITION, Stage.NORMAL),
    Stage.IRRADIANCE: (Stage.OBJECT, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY),
    Stage.EXITANCE: (Stage.OBJECT, Stage.IRRADIANCE),
    Stage.RADIANCE: (Stage.RAY, Stage.OBJECT, Stage.NORMAL, Stage.EXITANCE),
}


@dataclass(frozen=True, kw_only=True)
class Handed:
    """A renderer's earlier stages at some pixels (n,), and the movement of each of their numbers."""

    pixels: np.ndarray  # (n,): flat indices
    rows: Mapping[Stage, np.ndarray]  # (n, channels)
    rounding: Mapping[Stage, np.ndarray]  # (n, 1) or (n, channels): per unit of roundoff
    whole: Mapping[Stage, np.ndarray]  # (n, 1) or (n, channels): from an output's step, and from separate passes

    def moved(self, problem: Problem) -> dict[Stage, np.ndarray]:
        """Return the moved rows; the random numbers of a pixel do not depend on the other pixels."""
        moved, place = {}, 0
        numbers = problem.drawn(self.pixels, sum(values.shape[1] for values in self.rows.values()))
        for stage, values in self.rows.items():
            if stage not in self.rounding:
                moved[stage] = values
                continue
            drawn = numbers[:, place : place + values.shape[1]]
            place += values.shape[1]
            with np.errstate(invalid="ignore"):  # the infinite distance of a miss
                off = (problem.amount * self.rounding[stage] + self.whole.get(stage, 0.0)) * drawn
                moved[stage] = np.where(np.isfinite(values), values + off, values)
        return moved


@dataclass(frozen=True, kw_only=True)
class Continuing:
    """One continued stage of a renderer, and its pixels over their limits."""

    oracle: Analytic
    problems: Problems
    stage: Stage
    answers: StageImages  # the renderer's, (height, width, channels)
    limit: np.ndarray  # (height, width) or (height, width, channels)
    reach: DecisionReach
    declared: Declared
    unit: float  # unit roundoff
    # Movement of a stage's numbers in addition to rounding, (height, width, ...).
    whole: Mapping[Stage, np.ndarray | float]

    def explain(self, over: np.ndarray) -> Explained:
        """Return the explanations of the pixels (height, width) that are over the limit."""
        nothing = {name: np.zeros_like(over) for name in ("rounding", "epsilon", "unexamined")}
        explained = Explained(**nothing)
        # Pixels whose rays rounding turns by more than the image's size are not examined.
        lost = over & (self.reach.image > sum(over.shape))
        explained.unexamined[lost] = True
        over = over & ~lost
        settled = over & ~self._changing(over, self._far())
        left = over & ~settled
        self._judge(left, 0, NOTHING, explained.rounding)
        # A stage that is wrong in a settled pixel is wrong; its other pixels need no examination.
        if not settled.any():
            for number in range(1, 1 + MOVING):
                self._judge(left, number, NOTHING, explained.rounding)
        if self.declared:
            self._judge(left, 1, self.declared, explained.epsilon)
        return explained

    def _judge(self, left: np.ndarray, number: int, declared: Declared, explained: np.ndarray) -> None:
        """Move the pixels that a round of problems explains from `left` to `explained`, both (height, width)."""
        if left.any():
            good = self._explained(left, self._problems(number), declared)
            explained |= good
            left &= ~good

    def _far(self) -> list[Problem]:
        """Return problems that are moved by `FARTHEST`."""
        scenes = [self.problems.moved(FARTHEST, number) for number in range(FIRST)]
        still = [replace(self.problems.itself(number), amount=FARTHEST) for number in range(FIRST)]
        return [*still, *(problem for problem in scenes if problem is not None)]

    def _problems(self, number: int) -> list[Problem]:
        if number == 0:
            return [replace(self.problems.itself(place), amount=AMOUNTS[place % 3]) for place in range(FIRST)]
        start = sum(ROUNDS[: number - 1])
        return list(self.problems.within(range(start, start + ROUNDS[number - 1])))

    def _changing(self, where: np.ndarray, problems: list[Problem]) -> np.ndarray:
        """Return the pixels of `where` (height, width) whose piece, side or miss changes in a problem."""
        changing = np.zeros_like(where)
        rows, columns = np.nonzero(where)
        if len(rows):
            changing[rows, columns] = self._answers(rows, columns, problems, self.declared)[2]
        return changing

    def _explained(self, left: np.ndarray, problems: list[Problem], declared: Declared) -> np.ndarray:
        """Return the pixels (height, width) that one of the problems explains."""
        good = np.zeros_like(left)
        rows, columns = np.nonzero(left)
        if len(rows) and problems:
            answers, pieces, changes = self._answers(rows, columns, problems, declared)
            own = np.asarray(self.answers[self.stage][rows, columns], dtype=np.float64)
            limit = np.asarray(self.limit)[rows, columns]
            limit = limit if limit.ndim == 2 else limit[:, np.newaxis]
            good[rows, columns] = changes & self._among(own, answers, pieces, limit)
        return good

    def _answers(
        self, rows: np.ndarray, columns: np.ndarray, problems: list[Problem], declared: Declared
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return problems' answers at pixels (K, n, channels), their pieces (K, n), and a mask (n,) of changes."""
        handed = self._handed(rows, columns)
        values, pieces = [], []
        for problem in problems:
            moved = handed.moved(problem)
            freedom = self._freedom(rows, columns, problem, declared)
            with np.errstate(all="ignore"):  # the renderer's stages may contain infinities
                values.append(self.oracle.continued(problem.scene, self.stage, moved, freedom))
            pieces.append(self._pieces(problem, moved, freedom))
        for moved in self._towards(handed):
            values.append(self.oracle.continued(self.problems.scene, self.stage, moved))
            pieces.append(self._pieces(self.problems.itself(), moved))
        with np.errstate(all="ignore"):
            usual = self.oracle.continued(self.problems.scene, self.stage, handed.rows)
        places = self._pieces(self.problems.itself(), handed.rows)
        answers, shown = np.stack(values), np.stack(pieces)
        changes = (shown != places).any(axis=0) | (np.isfinite(answers) != np.isfinite(usual)).any(axis=(0, 2))
        if self.stage in (Stage.OBJECT, Stage.VISIBILITY):
            changes |= (answers != usual).any(axis=(0, 2))
        return answers, shown, changes

    def _towards(self, handed: Handed) -> list[Mapping[Stage, np.ndarray]]:
        """Return the renderer's stages with rays turned towards the objects that it names, by decreasing amounts.

        Rays that are turned at random rarely hit a particular one of many thin faces.
        """
        if self.stage not in (Stage.OBJECT, Stage.DISTANCE):
            return []
        scene, rays = self.problems.scene, handed.rows[Stage.RAY]
        objects = self.answers[Stage.OBJECT].reshape(-1, 2)[handed.pixels]
        with np.errstate(all="ignore"):
            way = self.oracle.rays(scene, self.oracle.image_points_of(scene, objects)) - rays
            # A movement of the eye turns the direction to a surface like a movement of the ray.
            camera = scene.camera
            apart = math.dist(camera.eye, camera.target)
            turned = 1 + (math.hypot(*camera.eye) + apart) / self._distances(handed.pixels, apart)
            most = AMOUNTS[-1] * handed.rounding[Stage.RAY] * turned + handed.whole.get(Stage.RAY, 0.0)
            size = np.abs(way).max(axis=1, keepdims=True)
            step = np.nan_to_num(way * np.minimum(1.0, most / np.where(size > 0, size, 1.0)))
        return [{**handed.rows, Stage.RAY: rays + step * 0.5**halved} for halved in range(HALVINGS)]

    def _distances(self, pixels: np.ndarray, otherwise: float) -> np.ndarray:
        """Return the distances [m] of the renderer's hits, (n, 1), or `otherwise` [m] without a hit."""
        if Stage.DISTANCE not in self.answers:
            return np.full((len(pixels), 1), otherwise)
        distances = np.asarray(self.answers[Stage.DISTANCE], dtype=np.float64).reshape(-1, 1)[pixels]
        return np.where(np.isfinite(distances) & (distances > 0), distances, otherwise)

    def _among(self, own: np.ndarray, values: np.ndarray, pieces: np.ndarray, limit: np.ndarray) -> np.ndarray:
        """Return a mask (n,): `own` (n, channels) equals a problem's values or is between those of a piece."""
        if self.stage is Stage.OBJECT:
            return np.asarray(all_of(values == own).any(axis=0))
        if self.stage is Stage.VISIBILITY:
            return all_of(np.asarray((values == own).any(axis=0)))
        good, left = np.zeros(len(own), dtype=bool), np.ones(pieces.shape, dtype=bool)
        with np.errstate(invalid="ignore"):
            while (pixels := np.flatnonzero(left.any(axis=0) & ~good)).size:
                first = left[:, pixels].argmax(axis=0)
                same = left[:, pixels] & (pieces[:, pixels] == pieces[first, pixels])
                left[:, pixels] &= ~same
                answers, here = values[:, pixels], same[..., np.newaxis]
                low, high = np.where(here, answers, np.inf).min(axis=0), np.where(here, answers, -np.inf).max(axis=0)
                value, slack = own[pixels], limit[pixels]
                inside = ((value >= low - slack) & (value <= high + slack)) | ((value == low) & (value == high))
                good[pixels] = all_of(inside)
        return good

    def _pieces(
        self, problem: Problem, received: Mapping[Stage, np.ndarray], freedom: Freedom | None = None
    ) -> np.ndarray:
        """Return the number (n,) of the piece: values with the same number may span an interval."""
        objects = received[Stage.OBJECT] if Stage.OBJECT in received else np.zeros((len(received[Stage.RAY]), 2))
        if self.stage is Stage.NORMAL:
            with np.errstate(all="ignore"):
                turned = dot(self.oracle.continued(problem.scene, self.stage, received), received[Stage.RAY]) < 0
                return 2 * self.oracle.pieces_at(problem.scene, received) + turned
        if self.stage is Stage.DISTANCE:
            with np.errstate(all="ignore"):
                distances = self.oracle.continued(problem.scene, self.stage, received, freedom)
                at = self.oracle.positions(problem.scene, received[Stage.RAY], objects, distances)
                return self.oracle.pieces_at(problem.scene, {**received, Stage.POSITION: at})
        if self.stage is Stage.RADIANCE:
            return (dot(received[Stage.NORMAL], received[Stage.RAY]) < 0).astype(int)
        return np.zeros(len(objects), dtype=int)

    def _handed(self, rows: np.ndarray, columns: np.ndarray) -> Handed:
        flat = {
            stage: np.asarray(self.answers[stage][rows, columns], dtype=np.float64) for stage in READ_BY[self.stage]
        }
        eye = float(np.linalg.norm(self.problems.scene.camera.eye))
        away = np.zeros((len(rows), 1))
        if Stage.POSITION in flat:
            away = np.linalg.norm(flat[Stage.POSITION] - np.asarray(self.problems.scene.camera.eye), axis=1)[
                :, np.newaxis
            ]
        sizes = {
            Stage.RAY: lambda values: np.ones((len(values), 1)),
            Stage.DISTANCE: np.abs,
            Stage.POSITION: lambda values: eye + away,
            Stage.NORMAL: lambda values: np.ones((len(values), 1)),
            Stage.IRRADIANCE: np.abs,
            Stage.EXITANCE: np.abs,
        }
        with np.errstate(invalid="ignore"):
            rounding = {stage: self.unit * sizes[stage](values) for stage, values in flat.items() if stage in sizes}
        whole = {}
        for stage, off in self.whole.items():
            if stage in rounding:
                off = np.broadcast_to(off, (*self.reach.image.shape, *np.shape(off)[2:]))[rows, columns]
                whole[stage] = off if off.ndim == 2 else off[:, np.newaxis]
        return Handed(pixels=rows * self.reach.image.shape[1] + columns, rows=flat, rounding=rounding, whole=whole)

    def _freedom(self, rows: np.ndarray, columns: np.ndarray, problem: Problem, declared: Declared) -> Freedom | None:
        if self.stage not in (Stage.OBJECT, Stage.DISTANCE, Stage.VISIBILITY):
            return None
        shape = self.reach.image.shape
        drawn = np.abs(problem.drawn(rows * shape[1] + columns, COUNT)[:, -4:])
        shadow = np.broadcast_to(declared.shadow, shape)[rows, columns] * drawn[:, 1]
        shadow = shadow * max(1.0, problem.amount / AMOUNTS[-1])
        skips = drawn[:, 2] < 1 / 3
        share = problem.amount / AMOUNTS[-1]
        lift = self.reach.lift[rows, columns] * drawn[:, 0] * share
        return Freedom(
            lift=lift + np.where(skips, 0.0, shadow),
            blind=np.where(skips, shadow, 0.0),
            light=declared.light,
            near=declared.ray,
            plane=drawn[:, 3] < 1 / 2,
            tie=self.reach.tie[rows, columns] + declared.tie,
            draw=problem.draw,
        )
