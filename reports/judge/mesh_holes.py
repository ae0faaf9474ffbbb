"""Edge pixels that faces of one mesh surround: a miss there is a hole, light through it a leak.

The oracle says where a mesh goes on over all of an edge's reach (`enclosed`), and names each face that comes near.
There a miss, and what lies behind, is a hole. Light is 0 there only if one of the faces may be dark: turned away,
unlit, in shadow, or so near to it that rounding decides.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.answers import all_of, any_of, dot, length
from rayproof.reports.judge.comparison import LIGHT, Comparison, roundoff
from rayproof.reports.judge.conditioning import condition
from rayproof.reports.judge.edge_sides import Sides, radius_of
from rayproof.reports.judge.limits import HIT, limits
from rayproof.reports.judge.oracle import FullOracle

MOST = 1 << 17  # faces near the pixels that are asked about at once; of more, nothing is said
SEEN = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """What is around some pixels: a row of `sides` for each of their faces, and the oracle's answers twice on it."""

    sides: Sides
    places: np.ndarray  # (rows, 2, 2) px
    enclosed: np.ndarray  # (height, width), False where not asked

    def of(self, where: np.ndarray) -> "Neighbours":
        """Return the same of the pixels of `where` (height, width) alone."""
        rows = where[self.sides.rows, self.sides.columns]
        return Neighbours(
            sides=self.sides.at(where),
            places=self.places[rows],
            enclosed=self.enclosed & where,
        )


def neighbours(
    oracle: FullOracle, scene: Scene, stages: tuple[Stage, ...], where: np.ndarray, reach: np.ndarray
) -> Neighbours:
    """Return the faces near the pixels of `where` (height, width), within their `reach` [px]."""
    rows, columns = np.nonzero(where)
    centres = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    found = oracle.surroundings(scene, centres, radius_of(reach[rows, columns]))
    told = len(found.points) <= MOST
    points, places = (found.points, found.places) if told else (found.points[:0], found.places[:0])
    answers = oracle.at(scene, stages, places.reshape(-1, 2)) if len(places) else {}
    enclosed = np.zeros_like(where)
    enclosed[rows, columns] = found.enclosed & told
    return Neighbours(
        sides=Sides(
            rows=rows[points],
            columns=columns[points],
            answers={stage: image.reshape(len(places), 2, -1) for stage, image in answers.items()},
            spare=1.0,  # two places say no more of a face
        ),
        places=places,
        enclosed=enclosed,
    )


def faces_near(pair: Comparison, where: np.ndarray) -> list[Neighbours]:
    """Return the faces near the pixels of `where` (height, width) that are outlines, up to the normal.

    Within the next power of two of the edges' reach, so that pairs of renderers that round alike look at the same.
    """
    reach = radius_of(np.where(pair.twins, 0.0, pair.classes.reach))
    reach = np.exp2(np.ceil(np.log2(reach)))
    where = where & pair.classes.outline
    known = pair.base.parts(
        ("faces near", reach.tobytes()), where, lambda new: neighbours(pair.base.oracle, pair.scene, SEEN, new, reach)
    )
    return [part for part in (each.of(where) for each in known) if len(part.places)]


def holes(pair: Comparison, stage: Stage, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width) show nothing, or what lies behind, where a mesh surrounds them."""
    ours = pair.subject.answers
    shape = where.shape
    enclosed, met, farthest = np.zeros(shape, bool), np.zeros(shape, bool), np.zeros(shape)
    for around in faces_near(pair, where):
        rows, columns = around.sides.rows, around.sides.columns
        enclosed |= around.enclosed
        np.maximum.at(farthest, (rows, columns), around.sides.answers[Stage.DISTANCE].max(axis=(1, 2)))
        if stage is Stage.OBJECT:
            same = all_of(around.sides.answers[stage] == ours[stage][rows, columns][:, np.newaxis]).any(axis=1)
            np.logical_or.at(met, (rows, columns), same)
    if not enclosed.any():
        return enclosed
    farthest = farthest + pair.classes.depth
    if stage is Stage.OBJECT:
        given = {Stage.RAY: pair.truth[Stage.RAY], stage: ours[stage]}
        apart = pair.base.oracle.continue_from(pair.scene, Stage.DISTANCE, given)[..., 0]
        return enclosed & ~met & (apart > farthest)
    if stage is Stage.DISTANCE:
        return enclosed & (ours[stage][..., 0] > farthest + pair.limits.end_to_end[stage])
    return enclosed & ~any_of(ours[stage] != 0)  # position and normal are 0 where nothing is seen


def may_be_dark(pair: Comparison, stage: Stage, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width), all at outlines, may have no light at all at `stage`.

    What a renderer moves along the normal before its feelers, or does not see there, must leave every face near.
    """
    pixel = pair.conditioning.distance * pair.conditioning.pixel_angle
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = pair.classes.reach + np.where(_epsilon(pair) > 0, 2 * _epsilon(pair) / pixel, 0.0)
    # Nothing is looked at beyond the neighbouring pixel's centre, nor twice where the mesh ends sooner.
    enclosed = [around.enclosed for around in faces_near(pair, where)]
    asked = where & (reach <= 0.5) & np.logical_or.reduce([np.zeros_like(where), *enclosed])
    if not asked.any():
        return where
    key = ("all lit", pair.rules, asked.tobytes())
    return where & ~pair.base.once(key, lambda: _all_lit(pair, asked, reach))[..., LIGHT.index(stage)]


def _all_lit(pair: Comparison, where: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return which enclosed pixels of `where` have light on each face near, and not so little that rounding decides.

    One for each of the stages of light, (height, width, 3).
    """
    scene = pair.scene
    stages = tuple(one for one in IMAGE_STAGES if one in pair.truth)
    around = neighbours(pair.base.oracle, scene, stages, where, reach)
    found = np.repeat(around.enclosed[..., np.newaxis], len(LIGHT), axis=-1)
    if not found.any():
        return found
    around = around.of(around.enclosed)
    rows, columns, seen = around.sides.rows, around.sides.columns, around.sides.answers
    near = pair.base.oracle.near(scene, around.places.reshape(-1, 2))
    c = condition(scene, seen)
    renderers = (pair.subject, pair.reference)
    each = [limits(scene, seen, c, roundoff(renderer), by_matrices=renderer.by_matrices) for renderer in renderers]
    across, along = sum(one.lifted for one in each), sum(one.position for one in each)
    turned = sum(one.end_to_end[Stage.NORMAL] + one.end_to_end[Stage.RAY] for one in each)
    # Another surface that follows so closely may be seen in its place, or met by a feeler.
    depth = pair.classes.depth[rows, columns] + 2 * _epsilon(pair)[rows, columns]
    apart = c.hit & (near.gaps.reshape(c.hit.shape) > depth[:, np.newaxis] / c.cosine)
    lit = np.zeros(c.hit.shape, dtype=bool)
    for index, light in enumerate(scene.lights):
        toward = np.asarray(light.position) - seen[Stage.POSITION]
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = dot(toward, seen[Stage.NORMAL]) / length(toward)
            shift = across + _thrown(pair, index)[rows, columns, np.newaxis]
            shift = (shift / cosine + along) / (c.distance * c.pixel_angle)
        sure = cosine > sum(one.cosine[..., index] for one in each)
        sure &= (seen[Stage.VISIBILITY][..., index] > 0) & (near.shadows[:, index].reshape(lit.shape) > shift)
        sure &= length(toward) > 4 * along
        ended = any(end.light == index for end in pair.base.edges.light_ends)
        lit |= sure & (not ended and any(flux > 0 for flux in light.flux))
    facing = -dot(seen[Stage.NORMAL], seen[Stage.RAY])
    lit &= apart & (np.abs(facing) > turned)
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    colored = any_of(albedo[seen[Stage.OBJECT][..., 0].astype(int)] > 0)
    for channel, bright in enumerate((lit, lit & colored, lit & colored & (facing > 0))):
        np.logical_and.at(found[..., channel], (rows, columns), bright.all(axis=1))
    # Where two normals are a right angle apart or more, a start that moves along one may leave the other face behind.
    order = np.lexsort((columns, rows))
    starts = np.flatnonzero(np.diff(rows[order] * where.shape[1] + columns[order], prepend=-1))
    for some in np.split(order, starts[1:]):
        normals = seen[Stage.NORMAL][some].reshape(-1, 3)
        found[rows[some[0]], columns[some[0]]] &= bool((normals @ normals.T > 0).all())
    return found


def leaking(pair: Comparison, where: np.ndarray) -> np.ndarray:
    """Return which pixels of `where` (height, width) have an inner edge of a blocker on their way to a light.

    So near that rounding decides which face hides the light.
    """
    found, c = np.zeros_like(where), pair.conditioning
    rows, columns = np.nonzero(where)
    centres = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    seams = pair.base.oracle.near(pair.scene, centres).seams
    for index, light in enumerate(pair.scene.lights):
        toward = np.asarray(light.position) - pair.truth[Stage.POSITION]
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.abs(dot(toward, pair.truth[Stage.NORMAL])) / length(toward)
            shift = (pair.limits.lifted + _thrown(pair, index)) / cosine + pair.limits.position
            near = seams[:, index] <= (shift / (c.distance * c.pixel_angle))[rows, columns]
        found[rows, columns] |= near & (pair.truth[Stage.VISIBILITY][rows, columns, index] == 0)
    return found


def _thrown(pair: Comparison, light: int) -> np.ndarray:
    """Return how far [m] (height, width) its blocker's and the feeler's start's own errors may move a shadow's edge."""
    g = max((roundoff(pair.subject), roundoff(pair.reference)), key=lambda one: one(1))
    return g(HIT) * pair.base.thrown(light) + 2 * _epsilon(pair)


def _epsilon(pair: Comparison) -> np.ndarray:
    """Return how far [m] (height, width) the two admit to move a feeler's start, or not to see there."""
    both = pair.subject.shadow_epsilon + pair.reference.shadow_epsilon
    return np.broadcast_to(both, pair.classes.outline.shape)
