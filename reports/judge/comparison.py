"""The bench at which one candidate is judged against one witness: each stage measured once, on the pair's terms."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Mesh, Plane, Scene, Square, Triangle
from rayproof.cases.stages import Stage, StageImages, upto
from rayproof.reports.judge.answers import Answers, all_of, any_of, dot, length
from rayproof.reports.judge.common_factors import Bias, bias
from rayproof.reports.judge.edge_values import (
    Held,
    Seen,
    Sides,
    excused,
    excused_anyhow,
    held,
    sides,
    with_ends,
    with_twins,
    with_what_is_behind,
)
from rayproof.reports.judge.limits import HIT, POINT, Roundoff
from rayproof.reports.judge.measurement import Kind, Measurement, held_to, measure, ratios
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.scene_truth import LIGHT, Ground, Terms
from rayproof.reports.judge.surrounded import faces_near, leaking, may_be_dark

GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One candidate before one witness, on the ground of the oracle's truth, whoever the witness is."""

    ground: Ground
    candidate: Answers
    witness: Answers

    @cached_property
    def terms(self) -> Terms:
        """Return the limits and pixel classes of the two."""
        return Terms(ground=self.ground, candidate=self.candidate, witness=self.witness)

    def _ends(self, where: np.ndarray) -> Sides:
        """Return the same at some of the pixels (height, width), and where around them what is seen changes."""
        seen = self.ground.author(self.candidate, Stage.OBJECT)
        key = "ends", self.terms.rounding, self.terms.blurred, seen, where.tobytes()
        reach = np.where(self.terms.twins, 0.0, self.terms.classes.reach)
        return self.ground.once(
            key, lambda: with_ends(self._sides, self.ground.oracle, self.ground.scene, where, reach)
        )

    @cached_property
    def _sides(self) -> Sides:
        """Return the oracle's answers around every edge pixel."""
        scene, truth, oracle, classes = self.ground.scene, self.ground.truth, self.ground.oracle, self.terms.classes
        twins = self.terms.twins
        # Outlines do not depend on the shadows' epsilons.
        key = self.terms.rounding, self.terms.blurred
        around = self.ground.once(
            ("sides", *key),
            # Where no outline is near, what is seen is what the centre shows, or what lies where that does.
            lambda: sides(oracle, scene, (Stage.RAY, *GEOMETRY), classes.outline, np.where(twins, 0.0, classes.reach)),
        )
        close = self.ground.edges.gap <= classes.depth
        if Stage.OBJECT not in self.candidate.answers:
            about = around, oracle, scene, truth, close, classes.depth
            return self.ground.once(("behind", *key), lambda: with_what_is_behind(*about))
        # Candidates that see the same objects, and the witnesses that they meet, have the same.
        seen, ours = self.ground.author(self.candidate, Stage.OBJECT), self.candidate.answers
        return self.ground.once(
            ("twins", *key, seen), lambda: with_twins(around, oracle, scene, truth, ours, classes.depth)
        )

    def _excused(
        self, stage: Stage, ratio: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
    ) -> Held:
        """Return the edge pixels that have a side's value; the oracle is asked only if an edge pixel differs at all."""
        differ = edge & ~(ratio <= 1)
        none = np.zeros(edge.shape, dtype=bool)
        if not np.any(differ):
            return Held(good=none, interval=none)
        if stage in LIGHT:
            return self._lit(stage, differ)
        find = excused_anyhow if Stage.OBJECT not in self.candidate.answers else excused
        objects = self.ground.truth[Stage.OBJECT][..., 0]
        if stage in (Stage.DISTANCE, Stage.POSITION):
            # Either of two faces of one shape: as far from one another as they lie.
            apart = np.where(self.terms.twins, self.ground.edges.gap, 0.0)
            limit = limit + (apart[..., np.newaxis] if limit.ndim == 3 else apart)
        good = find(stage, self.candidate.answers, self._sides, limit, objects, continued=continued)
        left = differ & ~good
        if left.any():
            good |= find(stage, self.candidate.answers, self._ends(left), limit, objects, continued=continued)
            left = differ & ~good
            for around in faces_near(self.terms, left):
                good |= find(stage, self.candidate.answers, around.sides, limit, objects, continued=continued)
            for terms, around in self._clipped_elsewhere(left):
                own = terms.limits.continued if continued else terms.limits.end_to_end
                wider = np.maximum(limit, own.get(stage, 0.0))
                good |= find(stage, self.candidate.answers, around, wider, objects, continued=continued)
        return Held(good=good, interval=none)

    def _clipped_elsewhere(self, where: np.ndarray) -> tuple[tuple[Terms, Sides], ...]:
        """Return what pixels see, and the terms, if clipping stands to either side of what rounding decides there."""
        clipped = self.terms.classes.clipped
        where = where & (clipped > 0)
        if not where.any():
            return ()
        stages, reach = (Stage.RAY, *GEOMETRY), np.zeros(where.shape)
        found = []
        for base in self.ground.clipped_elsewhere(2 * float(clipped.max())):
            around = sides(base.oracle, base.scene, stages, where, reach)
            found.append((replace(self.terms, ground=base), around))
        return tuple(found)

    def _lit(self, stage: Stage, where: np.ndarray) -> Held:
        """Return which pixels of `where` have a value of light that some object and some choice of lights gives."""
        good, interval = np.zeros(where.shape, dtype=bool), np.zeros(where.shape, dtype=bool)
        outline, truth = self.terms.classes.outline, self.ground.truth
        rows, columns = np.nonzero(where & ~outline)
        kinds = (Stage.RAY, Stage.OBJECT, Stage.POSITION, Stage.NORMAL)
        # Away from outlines one surface is seen, and its place is known as well as the limits say.
        here = {one: truth[one][rows, columns][:, np.newaxis] for one in kinds}

        def judge(around: Sides, terms: Terms = self.terms) -> None:
            rows, columns = around.rows, around.columns
            rays, objects, positions, normals = (around.answers[one] for one in kinds)
            seen = Seen(rays=rays, objects=objects, positions=positions, normals=normals, spare=around.spare)
            values = self._ours(stage)[rows, columns]
            lights = terms.lights(stage, rows, columns, values, objects[..., 0])
            found = held(self.ground.scene, stage, values, seen, lights)
            np.logical_or.at(good, (rows, columns), found.good)
            np.logical_or.at(interval, (rows, columns), found.interval)

        judge(Sides(rows=rows, columns=columns, answers=here))
        for more in (self._sides.at, self._ends):
            left = where & outline & ~good
            if left.any():
                judge(more(left))
        left = where & outline & ~good
        if left.any():
            for around in faces_near(self.terms, left):
                judge(around.sides)
        black = where & outline & good & self._black(stage)
        if black.any():
            wrong = black & ~may_be_dark(self.terms, stage, black)
            good, interval = good & ~wrong, interval & ~wrong
        for terms, around in self._clipped_elsewhere(where & ~good):
            judge(around, terms)
        return Held(good=good, interval=interval)

    def _black(self, stage: Stage) -> np.ndarray:
        """Return where the candidate has no light at all, and the oracle more than an error or an output's step."""
        return ~any_of(self._ours(stage) != 0) & any_of(self.ground.truth[stage] > self.terms.limits.end_to_end[stage])

    def authors(self, stage: Stage) -> tuple[str | None, str | None]:
        """Return by whom the two answers to a stage are, as the memo knows them."""
        return self.ground.author(self.candidate, stage), self.ground.author(self.witness, stage)

    def end_to_end(self, stage: Stage) -> Measurement:
        """Measure the candidate's stage against the witness's own; once for candidates that are equal in it."""
        # At an edge what the candidate sees there decides which sides its value may be.
        seen = tuple(self.ground.author(self.candidate, one) for one in (Stage.RAY, *GEOMETRY))
        key = ("end to end", stage, self.terms.rules, *self.authors(stage), *seen)
        return self.ground.once(key, lambda: self._end_to_end(stage))

    def _end_to_end(self, stage: Stage) -> Measurement:
        classes = self.terms.classes
        shape = classes.outline.shape
        limit = self.terms.limits.end_to_end.get(stage, np.zeros(shape))
        edge = classes.edge(stage)
        return self._against(stage, self._theirs(stage), limit, edge, continued=False)

    def _theirs(self, stage: Stage) -> np.ndarray:
        """Return the witness's answer; the oracle's, where a leak between a blocker's faces leaves the witness no say.

        The candidate is held to the oracle there, as strictly as elsewhere: that a way through an inner edge is blocked
        is no matter of rounding.
        """
        theirs = np.asarray(self.witness.answers[stage], dtype=np.float64)
        truth = self.ground.truth.get(stage)
        if truth is None or theirs.shape != truth.shape or stage not in (Stage.VISIBILITY, *LIGHT):
            return theirs
        ours, limit = self._ours(stage), self.terms.limits.end_to_end.get(stage, np.zeros(truth.shape[:2]))
        if ours.shape != truth.shape or self.witness.name == ORACLE:
            return theirs
        with np.errstate(invalid="ignore"):
            differ = (ratios(stage, theirs, truth, limit)[0] > 1) & (ratios(stage, ours, truth, limit)[0] <= 1)
        differ &= ~self.terms.classes.edge(stage)
        if not differ.any():
            return theirs
        return np.where(leaking(self.terms, differ)[..., np.newaxis], truth, theirs)

    def _against(
        self, stage: Stage, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
    ) -> Measurement:
        if stage is Stage.VISIBILITY:
            return self._visibility(theirs, limit, edge)
        compared = ratios(stage, self._ours(stage), theirs, limit)
        side = self._excused(stage, compared[0], limit, edge, continued=continued)
        if stage is not Stage.RAY and self._within_faces.any():
            within = self._within_faces
            if continued and stage is Stage.RADIANCE:
                within = within & self._either_side(theirs)
            if not continued or stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL, Stage.RADIANCE):
                edge, side = edge | within, replace(side, good=side.good | within)
        return self._measure(stage, theirs, limit, edge, side, compared)

    @cached_property
    def _within_faces(self) -> np.ndarray:
        """Return the pixels (height, width) whose ray runs within a face that holds the eye and ends on that face.

        Where along the ray is a matter of rounding, so the answer is held to its own earlier stages alone.
        """
        slack, ours, scene = self.terms.classes.skimming, self.candidate.answers, self.ground.scene
        good = np.zeros(slack.shape, dtype=bool)
        if not slack.any() or not set(GEOMETRY) <= set(ours):
            return good
        eye, near, g = np.asarray(scene.camera.eye), scene.camera.near, max(self.terms.roundoffs, key=lambda g: g(1))
        for row, column in np.argwhere(slack > 0):
            point, distance = ours[Stage.POSITION][row, column], float(ours[Stage.DISTANCE][row, column, 0])
            expected = eye + distance * self.ground.truth[Stage.RAY][row, column]
            off = float(slack[row, column]) * (1 + distance / near)
            moved = self.terms.limits.end_to_end[Stage.RAY][row, column] * distance
            close = length(point - expected) <= off + moved + g(POINT) * (length(eye) + distance)
            index, face = ours[Stage.OBJECT][row, column].astype(int)
            corners = _corners(scene, index, face)
            if corners is not None and close and distance >= near * (1 - g(HIT)):
                normal = ours[Stage.NORMAL][row, column]
                endless = isinstance(scene.shapes[index], Plane)
                good[row, column] = _on_face(corners, point, normal, off, endless=endless)
        return good

    def _either_side(self, expected: np.ndarray) -> np.ndarray:
        """Return where (height, width) radiance is that of a surface seen from its other side: nothing, or something.

        A ray that runs within a face sees its front or its back by rounding.
        """
        ours, most = self._ours(Stage.RADIANCE), self.candidate.answers.get(Stage.EXITANCE, np.inf)
        return (all_of(ours == 0) | all_of(expected == 0)) & all_of((ours >= 0) & (ours <= most))

    def _visibility(self, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray) -> Measurement:
        """Measure visibility, where edges are a matter of each light: of an undecided one both 0 and 1 are right."""
        ours, classes = self._ours(Stage.VISIBILITY), self.terms.classes
        if ours.shape == theirs.shape:
            either = (classes.light | classes.outline[..., np.newaxis]) & np.isin(ours, (0.0, 1.0))
            theirs = np.where(either, ours, theirs)
            edge = edge | classes.edge(Stage.VISIBILITY)
        good = all_of(ours == theirs)
        compared = ratios(Stage.VISIBILITY, ours, theirs, limit)
        return self._measure(
            Stage.VISIBILITY, theirs, limit, edge, Held(good=good, interval=np.zeros_like(good)), compared
        )

    def _ours(self, stage: Stage) -> np.ndarray:
        return self.candidate.answers[stage]

    def _finite(self, stage: Stage) -> bool:
        """Say whether all of the candidate's stage is finite; asked once of an image, whoever it is held against."""
        author = self.ground.author(self.candidate, stage)
        return self.ground.once(("finite", stage, author), lambda: bool(np.isfinite(self._ours(stage)).all()))

    def inside(self, stage: Stage) -> np.ndarray:
        """Return error over limit end to end, (height, width), 0 at edges: what is judged strictly."""
        classes = self.terms.classes
        limit = self.terms.limits.end_to_end.get(stage, np.zeros(classes.outline.shape))
        theirs = np.asarray(self.witness.answers[stage], dtype=np.float64)
        ratio = ratios(stage, self._ours(stage), theirs, limit)[0]
        return np.where(classes.edge(stage) | self.terms.near, 0.0, ratio)

    def _own(self, stage: Stage) -> tuple[str | None, ...]:
        """Return by whom the candidate's answers up to a stage are."""
        return tuple(self.ground.author(self.candidate, one) for one in upto(stage) if one is not Stage.CAMERA)

    def continued_value(self, stage: Stage) -> np.ndarray:
        """Return the stage as the oracle computes it from the candidate's own previous stages."""
        answers, scene = self.candidate.answers, self.ground.scene
        assert answers is not None

        def found() -> np.ndarray:
            with np.errstate(all="ignore"):  # from whatever was handed over, infinities too
                return self.ground.oracle.continue_from(scene, stage, answers)

        return self.ground.once(("continued value", stage, *self._own(stage)[:-1]), found)

    def continued(self, stage: Stage) -> Measurement:
        """Measure the candidate's stage against what the oracle makes of the candidate's own previous stages."""
        key = ("continued", stage, self.terms.rules, *self._own(stage))
        return self.ground.once(key, lambda: self._continued(stage))

    def shared_factors(self, stage: Stage, *, continued: bool) -> Bias:
        """Return the factors that many pixels share at a stage of light, against the truth or `continued_value`."""
        value = self.continued_value(stage) if continued else None
        own = self._own(stage) if continued else self._own(stage)[-1:]
        key = ("bias", stage, self.terms.rules, *own)
        return self.ground.once(key, lambda: bias(self.terms, stage, self._ours(stage), value))

    def _continued(self, stage: Stage) -> Measurement:
        value = self.continued_value(stage)
        limit, edge = self.terms.continued(stage, value)
        return self._against(stage, np.asarray(value, dtype=np.float64), limit, edge, continued=True)

    def _near_or_beyond(self, stage: Stage, differ: np.ndarray) -> np.ndarray:
        """Return which of the pixels nearer than a party sees show what is there, or what lies beyond the epsilon."""
        mine = replace(self.candidate, ray_epsilon=0.0)
        good = np.zeros_like(differ)
        bases = [self.ground]
        if self.candidate.ray_epsilon:
            bases.append(self.ground.beyond(self.candidate.ray_epsilon))
        for base in bases:
            kinds = Bench(ground=base, candidate=mine, witness=_oracle(base.truth)).end_to_end(stage).kinds
            good |= differ & (kinds != Kind.WRONG) & (kinds != Kind.UNEXAMINED)
        return good

    def _measure(
        self,
        stage: Stage,
        theirs: np.ndarray,
        limit: np.ndarray,
        edge: np.ndarray,
        side: Held,
        compared: tuple[np.ndarray, np.ndarray],
    ) -> Measurement:
        near, good = self.terms.near, side.good
        if stage is not Stage.RAY and near.any():
            edge = edge | near
            differ = near & ~good & ~(compared[0] <= 1)
            good = good | (self._near_or_beyond(stage, differ) if differ.any() else differ)
        # A position's error is a share of how far away it is, wherever the world's origin lies.
        size = self.ground.conditioning.distance if stage is Stage.POSITION else None
        if limit is self.terms.limits.end_to_end.get(stage) and theirs is self.witness.answers.get(stage):
            key = ("held", stage, self.terms.rounding, self.ground.author(self.witness, stage))
            held = self.ground.once(key, lambda: held_to(stage, limit, theirs, size))
        else:
            held = held_to(stage, limit, theirs, size)
        return measure(
            stage,
            self._ours(stage),
            theirs,
            limit,
            edge=edge,
            hit=self.ground.conditioning.hit,
            flagged=self.terms.classes.flagged,
            excused=good,
            interval=side.interval,
            window=self.terms.window,
            held=held,
            precision=self.candidate.precision,
            finite=self._finite(stage),
            compared=compared,
        )


def _oracle(truth: StageImages) -> Answers:
    """Return the oracle's answers as a witness."""
    authors = dict.fromkeys(truth, "the truth")  # the witness of that name may have been asked apart
    return Answers(name=ORACLE, precision="float64", independent=True, answers=truth, authors=authors)


def _corners(scene: Scene, index: int, face: int) -> np.ndarray | None:
    """Return the corners (n, 3) [m] of a flat shape's face, of a plane those of a square in it; None of others."""
    shape = scene.shapes[index] if 0 <= index < len(scene.shapes) else None
    if isinstance(shape, Triangle | Mesh):
        faces = world_triangles(shape).astype(np.float64)
        return faces[face] if 0 <= face < len(faces) else None
    if isinstance(shape, Square | Plane):
        matrix = np.asarray(shape.to_world)
        corners = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
        return corners @ matrix[:3, :3].T + matrix[:3, 3]
    return None


def _on_face(corners: np.ndarray, point: np.ndarray, normal: np.ndarray, slack: float, *, endless: bool) -> bool:
    """Say whether a point (3,) is within `slack` [m] of a face, and a normal is the face's by corners in float32."""
    right = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    right = right / length(right)
    inwards = np.cross(right, np.roll(corners, -1, axis=0) - corners)
    heights = dot(point - corners, inwards) / length(inwards)
    turned = Roundoff("float32")(HIT) * np.abs(corners).max() / dot(corners.mean(axis=0) - corners, inwards).min()
    turned = turned * length(inwards).max()
    straight = min(length(normal - right), length(normal + right)) <= turned
    return bool(straight and abs(dot(point - corners[0], right)) <= slack and (endless or heights.min() >= -slack))
