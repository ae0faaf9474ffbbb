"""A comparison's stages measured: end to end, continued from the subject's own stages, each pixel strict or excused."""

from dataclasses import replace
from functools import partial

import numpy as np

from rayproof.cases.placement import placed, world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Square, Triangle
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers, all_of, any_of, dot, length, widest_near
from rayproof.reports.judge.common_factors import Factors, bias
from rayproof.reports.judge.comparison import GEOMETRY, LIGHT, Comparison
from rayproof.reports.judge.edge_sides import (
    SAMPLES,
    Sides,
    sides,
    with_both_sides_of_the_eye,
    with_ends,
    with_twins,
    with_what_is_behind,
)
from rayproof.reports.judge.edge_values import Held, Seen, excused, excused_anyhow, held
from rayproof.reports.judge.limits import HIT, POINT
from rayproof.reports.judge.measurement import Kind, held_to, measure, ratios
from rayproof.reports.judge.mesh_holes import faces_near, leaking, may_be_dark
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.results.case_records import Measurement


def _ends(pair: Comparison, where: np.ndarray) -> list[Sides]:
    """Return the same at some of the pixels, twins within reach, and where around them what is seen changes."""
    base, seen, ours = pair.base, pair.base.author(pair.subject, Stage.OBJECT), pair.subject.answers
    reach, key = np.where(pair.twins, 0.0, pair.classes.reach), ("ends", seen is None, pair.rounding, pair.blurred)

    def ended(new: np.ndarray) -> list[Sides]:
        found = base.parts(key, new, lambda some: with_ends(_behind(pair), base.oracle, base.scene, some, reach))
        return [part for part in (each.at(new) for each in found) if len(part.rows)]

    def found(new: np.ndarray) -> list[Sides]:
        return [
            with_twins(each, base.oracle, base.scene, base.truth, ours, _depth(pair), SAMPLES) for each in ended(new)
        ]

    known = [ended(where)] if seen is None else base.parts((*key, seen), where, found)
    return [part for part in (each.at(where) for parts in known for each in parts) if len(part.rows)]


def _faces(pair: Comparison, where: np.ndarray) -> list[Sides]:
    """Return what pixels of `where` see of each face of a mesh near by, and of each of a cube's that their hit is on.

    Rounding says which of a cube's faces a hit is on: at its outline also one that is turned away.
    """
    found, truth = [around.sides for around in faces_near(pair, where)], pair.truth
    for index, shape in enumerate(pair.scene.shapes):
        rows, columns = np.nonzero(where & pair.classes.outline & (truth[Stage.OBJECT][..., 0] == index))
        if not isinstance(shape, Cube) or not len(rows):
            continue
        linear, shift = placed(shape)
        inverse = np.linalg.inv(linear)
        local = (truth[Stage.POSITION][rows, columns] - shift) @ inverse.T
        slack = pair.limits.lifted[rows, columns]
        for axis, normal in enumerate(inverse):
            on = 0.5 - np.abs(local[:, axis]) <= slack * length(normal)
            if on.any():
                at = rows[on], columns[on]
                answers = {stage: truth[stage][at][:, np.newaxis] for stage in (Stage.RAY, *GEOMETRY)}
                side = np.sign(local[on, axis])[:, np.newaxis] * normal / length(normal)
                answers[Stage.NORMAL] = side[:, np.newaxis]
                found.append(Sides(rows=at[0], columns=at[1], answers=answers))
    return found


def _depth(pair: Comparison) -> np.ndarray:
    """Return how close [m] (height, width) two surfaces are that are not told apart; by a miss, those beside it."""
    depth = pair.classes.depth
    return np.where(pair.conditioning.hit, depth, widest_near(depth))


def _sides(pair: Comparison) -> Sides:
    """Return the oracle's answers around every edge pixel."""
    around, seen = _behind(pair), pair.base.author(pair.subject, Stage.OBJECT)
    if seen is None:
        return around
    # Subjects that see the same objects, and the references that they meet, have the same.
    about = pair.base.oracle, pair.scene, pair.truth, pair.subject.answers, pair.classes.depth, 1
    return pair.base.once(("twins", pair.rounding, pair.blurred, seen), lambda: with_twins(around, *about))


def _behind(pair: Comparison) -> Sides:
    """Return the answers around every edge pixel that do not depend on the object that the subject names."""
    scene, truth, oracle, classes = pair.base.scene, pair.base.truth, pair.base.oracle, pair.classes
    # Where no outline is near, what is seen is what the centre shows, or what lies where that does.
    reach = np.where(pair.twins, 0.0, classes.reach)
    # Outlines do not depend on the shadows' epsilons.
    key, once, stages = (pair.rounding, pair.blurred), pair.base.once, (Stage.RAY, *GEOMETRY)
    around = once(("sides", *key), lambda: sides(oracle, scene, stages, classes.outline, reach))
    if classes.at_eye.any() and len(around.rows):
        around = once(("eye", *key), partial(with_both_sides_of_the_eye, around, oracle, scene, truth, classes.at_eye))
    named, edges = Stage.OBJECT in pair.subject.answers, pair.base.edges
    close = (edges.covered <= classes.reach) & ~(edges.silhouette <= classes.reach)
    close = close if named else close | (edges.gap <= classes.depth)
    return once(
        ("behind", named, *key), partial(with_what_is_behind, around, oracle, scene, close, reach, _depth(pair))
    )


def _excused(
    pair: Comparison, stage: Stage, ratio: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
) -> Held:
    """Return the edge pixels that have a side's value; the oracle is asked only if an edge pixel differs at all."""
    differ = edge & ~(ratio <= 1)
    none = np.zeros(edge.shape, dtype=bool)
    if not np.any(differ):
        return Held(good=none, interval=none)
    if stage in LIGHT:
        return _lit(pair, stage, differ)
    find = excused_anyhow if Stage.OBJECT not in pair.subject.answers else excused
    objects = pair.base.truth[Stage.OBJECT][..., 0]
    if stage in (Stage.DISTANCE, Stage.POSITION):
        # Either of two faces of one shape: as far from one another as they lie.
        apart = np.where(pair.twins, pair.base.edges.gap, 0.0)
        limit = limit + (apart[..., np.newaxis] if limit.ndim == 3 else apart)
    good = find(stage, pair.subject.answers, _sides(pair), limit, objects, continued=continued)
    left = differ & ~good
    if left.any():
        for around in _ends(pair, left):
            good |= find(stage, pair.subject.answers, around, limit, objects, continued=continued)
        left = differ & ~good
        for around in _faces(pair, left):
            good |= find(stage, pair.subject.answers, around, limit, objects, continued=continued)
        for clipped, around in _clipped_elsewhere(pair, left):
            own = clipped.limits.continued if continued else clipped.limits.end_to_end
            wider = np.maximum(limit, own.get(stage, 0.0))
            good |= find(stage, pair.subject.answers, around, wider, objects, continued=continued)
    return Held(good=good, interval=none)


def _clipped_elsewhere(pair: Comparison, where: np.ndarray) -> tuple[tuple[Comparison, Sides], ...]:
    """Return what pixels see, and the comparison, if clipping stands to either side of what rounding decides there."""
    clipped = pair.classes.clipped
    where = where & (clipped > 0)
    if not where.any():
        return ()
    stages, reach = (Stage.RAY, *GEOMETRY), np.zeros(where.shape)
    found = []
    for base in pair.base.clipped_elsewhere(2 * float(clipped.max())):
        around = sides(base.oracle, base.scene, stages, where, reach)
        found.append((replace(pair, base=base), around))
    return tuple(found)


def _lit(pair: Comparison, stage: Stage, where: np.ndarray) -> Held:
    """Return which pixels of `where` have a value of light that some object and some choice of lights gives."""
    good, interval = np.zeros(where.shape, dtype=bool), np.zeros(where.shape, dtype=bool)
    outline, truth = pair.classes.outline, pair.base.truth
    rows, columns = np.nonzero(where & ~outline)
    kinds = (Stage.RAY, Stage.OBJECT, Stage.POSITION, Stage.NORMAL)
    # Away from outlines one surface is seen, and its place is known as well as the limits say.
    here = {one: truth[one][rows, columns][:, np.newaxis] for one in kinds}

    def judge(around: Sides, clipped: Comparison = pair) -> None:
        rows, columns = around.rows, around.columns
        rays, objects, positions, normals = (around.answers[one] for one in kinds)
        seen = Seen(rays=rays, objects=objects, positions=positions, normals=normals, spare=around.spare)
        values = _ours(pair, stage)[rows, columns]
        lights = clipped.lights(stage, rows, columns, values, objects[..., 0])
        found = held(pair.base.scene, stage, values, seen, lights)
        np.logical_or.at(good, (rows, columns), found.good)
        np.logical_or.at(interval, (rows, columns), found.interval)

    judge(Sides(rows=rows, columns=columns, answers=here))
    left = where & outline & ~good
    if left.any():
        judge(_sides(pair).at(left))
        for more in _ends(pair, where & outline & ~good):
            judge(more)
    left = where & outline & ~good
    if left.any():
        for around in _faces(pair, left):
            judge(around)
    black = where & outline & good & _black(pair, stage)
    if black.any():
        wrong = black & ~may_be_dark(pair, stage, black)
        good, interval = good & ~wrong, interval & ~wrong
    for clipped, around in _clipped_elsewhere(pair, where & ~good):
        judge(around, clipped)
    return Held(good=good, interval=interval)


def _black(pair: Comparison, stage: Stage) -> np.ndarray:
    """Return where the subject has no light at all, and the oracle more than an error or an output's step."""
    return ~any_of(_ours(pair, stage) != 0) & any_of(pair.base.truth[stage] > pair.limits.end_to_end[stage])


def measure_end_to_end(pair: Comparison, stage: Stage) -> Measurement:
    """Measure the subject's stage against the reference's own; once for subjects that are equal in it."""
    # At an edge what the subject sees there decides which sides its value may be.
    seen = tuple(pair.base.author(pair.subject, one) for one in (Stage.RAY, *GEOMETRY))
    key = ("end to end", stage, pair.rules, *pair.authors(stage), *seen)
    return pair.base.once(key, lambda: _end_to_end(pair, stage))


def _end_to_end(pair: Comparison, stage: Stage) -> Measurement:
    limit = pair.limits.end_to_end.get(stage, np.zeros(pair.classes.outline.shape))
    return _against(pair, stage, _theirs(pair, stage), limit, pair.classes.edge(stage), continued=False)


def _theirs(pair: Comparison, stage: Stage) -> np.ndarray:
    """Return the reference's answer; the oracle's, where a leak between a blocker's faces leaves the reference no say.

    The subject is held to the oracle there, as strictly as elsewhere: that a way through an inner edge is blocked
    is no matter of rounding.
    """
    theirs = np.asarray(pair.reference.answers[stage], dtype=np.float64)
    truth = pair.base.truth.get(stage)
    if truth is None or theirs.shape != truth.shape or stage not in (Stage.VISIBILITY, *LIGHT):
        return theirs
    ours, limit = _ours(pair, stage), pair.limits.end_to_end.get(stage, np.zeros(truth.shape[:2]))
    if ours.shape != truth.shape or pair.reference.name == ORACLE:
        return theirs
    with np.errstate(invalid="ignore"):
        differ = (ratios(stage, theirs, truth, limit)[0] > 1) & (ratios(stage, ours, truth, limit)[0] <= 1)
    differ &= ~pair.classes.edge(stage)
    if not differ.any():
        return theirs
    return np.where(leaking(pair, differ)[..., np.newaxis], truth, theirs)


def _against(
    pair: Comparison, stage: Stage, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
) -> Measurement:
    if stage is Stage.VISIBILITY:
        return _visibility(pair, theirs, limit, edge)
    compared = ratios(stage, _ours(pair, stage), theirs, limit)
    side = _excused(pair, stage, compared[0], limit, edge, continued=continued)
    # Where rounding turns rays by more than the image is large, what is around a pixel tells nothing of it.
    turned = pair.limits.end_to_end[Stage.RAY] > sum(edge.shape) * pair.conditioning.pixel_angle
    if (lost := edge & ~(compared[0] <= 1) & turned).any():
        side = Held(good=side.good | lost, interval=side.interval | (lost & ~side.good))
    within = _within_faces(pair)
    if stage is not Stage.RAY and within.any():
        if continued and stage is Stage.RADIANCE:
            within = within & _either_side(pair, theirs)
        if not continued or stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL, Stage.RADIANCE):
            edge, side = edge | within, replace(side, good=side.good | within)
    return _measure(pair, stage, theirs, limit, edge, side, compared)


def _within_faces(pair: Comparison) -> np.ndarray:
    """Return the pixels (height, width) whose ray runs within a face that holds the eye and ends on that face.

    Where along the ray is a matter of rounding, so the answer is held to its own earlier stages alone.
    """
    authors = (pair.base.author(pair.subject, stage) for stage in GEOMETRY)
    return pair.base.once(("within faces", pair.rules, *authors), lambda: _found_within_faces(pair))


def _found_within_faces(pair: Comparison) -> np.ndarray:
    slack, ours, scene = pair.classes.skimming, pair.subject.answers, pair.base.scene
    good = np.zeros(slack.shape, dtype=bool)
    if not slack.any() or not set(GEOMETRY) <= set(ours):
        return good
    eye, near, g = np.asarray(scene.camera.eye), scene.camera.near, max(pair.roundoffs, key=lambda g: g(1))
    limit, _ = pair.continued_limit(Stage.NORMAL, ours[Stage.NORMAL])
    for row, column in np.argwhere(slack > 0):
        point, distance = ours[Stage.POSITION][row, column], float(ours[Stage.DISTANCE][row, column, 0])
        expected = eye + distance * pair.base.truth[Stage.RAY][row, column]
        off = float(slack[row, column]) * (1 + distance / near)
        moved = pair.limits.end_to_end[Stage.RAY][row, column] * distance
        close = length(point - expected) <= off + moved + g(POINT) * (length(eye) + distance)
        index, face = ours[Stage.OBJECT][row, column].astype(int)
        corners = _corners(scene, index, face)
        if corners is not None and close and distance >= near * (1 - g(HIT)):
            normal = ours[Stage.NORMAL][row, column]
            endless, turned = isinstance(scene.shapes[index], Plane), float(limit[row, column])
            good[row, column] = _on_face(corners, point, normal, off, turned, endless=endless)
    return good


def _either_side(pair: Comparison, expected: np.ndarray) -> np.ndarray:
    """Return where (height, width) radiance is that of a surface seen from its other side: nothing, or something.

    A ray that runs within a face sees its front or its back by rounding.
    """
    ours, most = _ours(pair, Stage.RADIANCE), pair.subject.answers.get(Stage.EXITANCE, np.inf)
    return (all_of(ours == 0) | all_of(expected == 0)) & all_of((ours >= 0) & (ours <= most))


def _visibility(pair: Comparison, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray) -> Measurement:
    """Measure visibility, where edges are a matter of each light: of an undecided one both 0 and 1 are right."""
    ours, classes = _ours(pair, Stage.VISIBILITY), pair.classes
    if ours.shape == theirs.shape:
        either = (classes.light | classes.outline[..., np.newaxis]) & np.isin(ours, (0.0, 1.0))
        theirs = np.where(either, ours, theirs)
        edge = edge | classes.edge(Stage.VISIBILITY)
    good = all_of(ours == theirs)
    compared = ratios(Stage.VISIBILITY, ours, theirs, limit)
    return _measure(
        pair, Stage.VISIBILITY, theirs, limit, edge, Held(good=good, interval=np.zeros_like(good)), compared
    )


def _ours(pair: Comparison, stage: Stage) -> np.ndarray:
    return pair.subject.answers[stage]


def _finite(pair: Comparison, stage: Stage) -> bool:
    """Say whether all of the subject's stage is finite; asked once of an image, whoever it is held against."""
    author = pair.base.author(pair.subject, stage)
    return pair.base.once(("finite", stage, author), lambda: bool(np.isfinite(_ours(pair, stage)).all()))


def inside(pair: Comparison, stage: Stage) -> np.ndarray:
    """Return error over limit end to end, (height, width), 0 at edges: what is judged strictly."""
    classes = pair.classes
    limit = pair.limits.end_to_end.get(stage, np.zeros(classes.outline.shape))
    theirs = np.asarray(pair.reference.answers[stage], dtype=np.float64)
    ratio = ratios(stage, _ours(pair, stage), theirs, limit)[0]
    return np.where(classes.edge(stage) | pair.near, 0.0, ratio)


def continued_value(pair: Comparison, stage: Stage) -> np.ndarray:
    """Return the stage as the oracle computes it from the subject's own previous stages."""
    answers, scene = pair.subject.answers, pair.base.scene

    def found() -> np.ndarray:
        with np.errstate(all="ignore"):  # from whatever was handed over, infinities too
            return pair.base.oracle.continue_from(scene, stage, answers)

    return pair.base.once(("continued value", stage, *pair.authors_upto(stage)[:-1]), found)


def measure_continued(pair: Comparison, stage: Stage) -> Measurement:
    """Measure the subject's stage against what the oracle makes of the subject's own previous stages."""
    key = ("continued", stage, pair.rules, *pair.authors_upto(stage))
    return pair.base.once(key, lambda: _continued(pair, stage))


def shared_factors(pair: Comparison, stage: Stage, *, continued: bool) -> Factors:
    """Return the factors that many pixels share at a stage of light, against the truth or `continued_value`."""
    value = continued_value(pair, stage) if continued else None
    own = pair.authors_upto(stage) if continued else pair.authors_upto(stage)[-1:]
    key = ("bias", stage, pair.rules, *own)
    return pair.base.once(key, lambda: bias(pair, stage, _ours(pair, stage), value))


def _continued(pair: Comparison, stage: Stage) -> Measurement:
    value = continued_value(pair, stage)
    limit, edge = pair.continued_limit(stage, value)
    return _against(pair, stage, np.asarray(value, dtype=np.float64), limit, edge, continued=True)


def _near_or_beyond(pair: Comparison, stage: Stage, differ: np.ndarray) -> np.ndarray:
    """Return which of the pixels nearer than a renderer sees show what is there, or what lies beyond the epsilon."""
    mine = replace(pair.subject, ray_epsilon=0.0)
    good = np.zeros_like(differ)
    bases = [pair.base]
    if pair.subject.ray_epsilon:
        bases.append(pair.base.beyond(pair.subject.ray_epsilon))
    for base in bases:
        seeing = Comparison(base=base, subject=mine, reference=_oracle(base.truth))
        kinds = measure_end_to_end(seeing, stage).kinds
        good |= differ & (kinds != Kind.WRONG) & (kinds != Kind.UNEXAMINED)
    return good


def _measure(
    pair: Comparison,
    stage: Stage,
    theirs: np.ndarray,
    limit: np.ndarray,
    edge: np.ndarray,
    side: Held,
    compared: tuple[np.ndarray, np.ndarray],
) -> Measurement:
    near, good = pair.near, side.good
    if stage is not Stage.RAY and near.any():
        edge = edge | near
        differ = near & ~good & ~(compared[0] <= 1)
        good = good | (_near_or_beyond(pair, stage, differ) if differ.any() else differ)
    # A position's error is a share of how far away it is, wherever the world's origin lies.
    size = pair.base.conditioning.distance if stage is Stage.POSITION else None
    if limit is pair.limits.end_to_end.get(stage) and theirs is pair.reference.answers.get(stage):
        key = ("held", stage, pair.rounding, pair.base.author(pair.reference, stage))
        held = pair.base.once(key, lambda: held_to(stage, limit, theirs, size))
    else:
        held = held_to(stage, limit, theirs, size)
    return measure(
        stage,
        _ours(pair, stage),
        theirs,
        limit,
        edge=edge,
        hit=pair.base.conditioning.hit,
        flagged=pair.classes.flagged,
        excused=good,
        interval=side.interval,
        window=pair.window,
        held=held,
        precision=pair.subject.precision,
        finite=_finite(pair, stage),
        compared=compared,
    )


def _oracle(truth: StageImages) -> Answers:
    """Return the oracle's answers as a reference."""
    authors = dict.fromkeys(truth, "the truth")  # the reference of that name may have been asked apart
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


def _on_face(
    corners: np.ndarray, point: np.ndarray, normal: np.ndarray, slack: float, turned: float, *, endless: bool
) -> bool:
    """Say whether a point (3,) is within `slack` [m] of a face, and a normal within `turned` of the face's."""
    right = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    right = right / length(right)
    inwards = np.cross(right, np.roll(corners, -1, axis=0) - corners)
    heights = dot(point - corners, inwards) / length(inwards)
    straight = min(length(normal - right), length(normal + right)) <= turned
    return bool(straight and abs(dot(point - corners[0], right)) <= slack and (endless or heights.min() >= -slack))
