"""Edge pixels that faces of one mesh surround: one of these faces is seen there, by whomever, and never nothing.

The oracle says where a mesh goes on over all of an edge's reach (`enclosed`), and names every face that comes near. There
a miss, and what lies behind, is a hole. Light is 0 there only if one of the faces may be dark: turned away, unlit, in
shadow, or so near to it that rounding decides.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.oracle import FullOracle
from rayproof.reports.judge.tolerance.channels import all_of, any_of, dot, length
from rayproof.reports.judge.tolerance.conditioning import condition
from rayproof.reports.judge.tolerance.edge_sides import Sides, radius_of
from rayproof.reports.judge.tolerance.limits import HIT, limits
from rayproof.reports.judge.tolerance.pair_limits import Terms, roundoff

MOST = 1 << 18  # faces looked at in one image; of more, nothing is said


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """What is around some pixels: the oracle's answers at each centre, and twice on every face that comes near."""

    sides: Sides
    places: np.ndarray  # (pixels, samples, 2) px
    enclosed: np.ndarray  # (pixels,)


def neighbours(
    oracle: FullOracle, scene: Scene, stages: tuple[Stage, ...], where: np.ndarray, reach: np.ndarray
) -> list[Neighbours]:
    """Return the faces near the pixels of `where` (height, width), within their `reach` [px]; none where too many.

    Pixels with about equally many faces come together.
    """
    rows, columns = np.nonzero(where)
    centres = np.stack([columns + 0.5, rows + (scene.camera.first_row + 0.5)], axis=-1)
    found = oracle.surroundings(scene, centres, radius_of(reach[rows, columns]))
    counts = 2 * np.bincount(found.points, minlength=len(rows))
    if counts.sum() > MOST:
        return []
    order = np.argsort(found.points, kind="stable")
    faces, first = found.places[order].reshape(-1, 2), np.cumsum(counts) - counts
    groups, sizes = [], np.ceil(np.log2(np.maximum(counts, 1)))
    for size in np.unique(sizes):
        here = np.flatnonzero(sizes == size)
        most = counts[here].max()
        places = np.repeat(centres[here, np.newaxis], 1 + most, axis=1)
        if most:
            # Where there are fewer, the first one again.
            place = np.where(np.arange(most) < counts[here, np.newaxis], np.arange(most), 0)
            places[:, 1:] = faces[first[here, np.newaxis] + place]
        answers = oracle.at(scene, stages, places.reshape(-1, 2))
        sides = Sides(
            rows=rows[here],
            columns=columns[here],
            answers={stage: image.reshape(*places.shape[:2], -1) for stage, image in answers.items()},
        )
        groups.append(Neighbours(sides=sides, places=places, enclosed=found.enclosed[here]))
    return groups


def holes(terms: Terms, stage: Stage, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width) show nothing, or what lies behind, where a mesh surrounds them."""
    found, ours = np.zeros_like(where), terms.candidate.answers
    assert ours is not None
    seen = (Stage.OBJECT, Stage.DISTANCE)
    where = where & terms.classes.outline
    for around in neighbours(terms.ground.oracle, terms.scene, seen, where, terms.classes.reach):
        rows, columns = around.sides.rows, around.sides.columns
        value, depth = ours[stage][rows, columns], terms.classes.depth[rows, columns]
        farthest = around.sides.answers[Stage.DISTANCE][..., 0].max(axis=1)
        if stage is Stage.OBJECT:
            given = {Stage.RAY: terms.truth[Stage.RAY], Stage.OBJECT: ours[Stage.OBJECT]}
            apart = terms.ground.oracle.continue_from(terms.scene, Stage.DISTANCE, given)[rows, columns, 0]
            met = all_of(around.sides.answers[Stage.OBJECT] == value[:, np.newaxis]).any(axis=1)
            beyond = ~met & (apart > farthest + depth)
        elif stage is Stage.DISTANCE:
            beyond = value[:, 0] > farthest + depth + terms.limits.end_to_end[stage][rows, columns]
        else:  # position and normal are 0 where nothing is seen
            beyond = ~any_of(value != 0)
        found[rows, columns] = around.enclosed & beyond
    return found


def may_be_dark(terms: Terms, stage: Stage, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width), all at outlines, may have no light at all at `stage`.

    What a party moves along the normal before its feelers, or does not see there, must leave every face near.
    """
    scene, classes = terms.scene, terms.classes
    lifted = _epsilon(terms)
    pixel = terms.conditioning.distance * terms.conditioning.pixel_angle
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = classes.reach + np.where(lifted > 0, 2 * lifted / pixel, 0.0)
    # Nothing is looked at beyond the neighbouring pixel's centre.
    asked = where & (reach <= 0.5)
    dark, stages = where.copy(), tuple(one for one in IMAGE_STAGES if one in terms.truth)
    for around in neighbours(terms.ground.oracle, scene, stages, asked, reach):
        if around.enclosed.any():
            dark[around.sides.rows, around.sides.columns] = ~(around.enclosed & _all_lit(terms, stage, around))
    return dark


def _all_lit(terms: Terms, stage: Stage, around: Neighbours) -> np.ndarray:
    """Return of which pixels (pixels,) each face near is lit, and not so nearly dark that rounding decides."""
    scene, rows, columns = terms.scene, around.sides.rows, around.sides.columns
    # Not at the centre itself, where two faces are met at once.
    seen = {one: image[:, 1:] for one, image in around.sides.answers.items()}
    near = terms.ground.oracle.near(scene, around.places[:, 1:].reshape(-1, 2))
    c = condition(scene, seen)
    parties = (terms.candidate, terms.witness)
    each = [limits(scene, seen, c, roundoff(party), by_matrices=party.by_matrices) for party in parties]
    across, along = sum(one.lifted for one in each), sum(one.position for one in each)
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    bright = any_of(albedo[seen[Stage.OBJECT][..., 0].astype(int)] > 0) | (stage is Stage.IRRADIANCE)
    turned = sum(one.end_to_end[Stage.NORMAL] + one.end_to_end[Stage.RAY] for one in each)
    facing = -dot(seen[Stage.NORMAL], seen[Stage.RAY])
    bright &= (np.abs(facing) > turned) & ((facing > 0) | (stage is not Stage.RADIANCE))
    # Another surface that follows so closely may be seen in its place, or met by a feeler.
    depth = terms.classes.depth[rows, columns] + 2 * _epsilon(terms)[rows, columns]
    bright &= near.gaps.reshape(bright.shape) > depth[:, np.newaxis] / c.cosine
    lit = np.zeros(bright.shape, dtype=bool)
    for index, light in enumerate(scene.lights):
        toward = np.asarray(light.position) - seen[Stage.POSITION]
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = dot(toward, seen[Stage.NORMAL]) / length(toward)
            shift = across + _thrown(terms, index)[rows, columns, np.newaxis]
            shift = (shift / cosine + along) / (c.distance * c.pixel_angle)
        sure = cosine > sum(one.cosine[..., index] for one in each)
        sure &= (seen[Stage.VISIBILITY][..., index] > 0) & (near.shadows[:, index].reshape(lit.shape) > shift)
        sure &= length(toward) > 4 * along
        ended = any(end.light == index for end in terms.ground.edges.light_ends)
        lit |= sure & (not ended and any(flux > 0 for flux in light.flux))
    # Where two normals are a right angle apart or more, a start that moves along one may leave the other face behind.
    alike = np.array([(normals @ normals.T > 0).all() for normals in seen[Stage.NORMAL]])
    return alike & (bright & lit & c.hit).all(axis=1)


def leaking(terms: Terms, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width) have an edge inside a blocker so near on the way to a light that
    rounding decides which face hides it.
    """
    found, c = np.zeros_like(where), terms.conditioning
    rows, columns = np.nonzero(where)
    centres = np.stack([columns + 0.5, rows + (terms.scene.camera.first_row + 0.5)], axis=-1)
    seams = terms.ground.oracle.near(terms.scene, centres).seams
    for index, light in enumerate(terms.scene.lights):
        toward = np.asarray(light.position) - terms.truth[Stage.POSITION]
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.abs(dot(toward, terms.truth[Stage.NORMAL])) / length(toward)
            shift = (terms.limits.lifted + _thrown(terms, index)) / cosine + terms.limits.position
            near = seams[:, index] <= (shift / (c.distance * c.pixel_angle))[rows, columns]
        found[rows, columns] |= near & (terms.truth[Stage.VISIBILITY][rows, columns, index] == 0)
    return found


def _thrown(terms: Terms, light: int) -> np.ndarray:
    """Return how far [m] (height, width) its blocker's and the feeler's start's own errors may move a shadow's edge."""
    g = max((roundoff(terms.candidate), roundoff(terms.witness)), key=lambda one: one(1))
    return g(HIT) * terms.ground.thrown(light) + 2 * _epsilon(terms)


def _epsilon(terms: Terms) -> np.ndarray:
    """Return how far [m] (height, width) the two admit to move a feeler's start, or not to see there."""
    both = terms.candidate.shadow_epsilon + terms.witness.shadow_epsilon
    return np.broadcast_to(both, terms.classes.outline.shape)
