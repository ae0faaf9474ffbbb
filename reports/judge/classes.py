"""Pixel classes: which pixels are so near to an edge that rounding may carry them across.

The oracle gives a sound lower bound on each pixel's distance to the nearest outline, shadow edge and terminator. A
pixel is `edge` if that distance is within what rounding can shift the edge by, which is derived here, in pixels.
So is one where rounding decides which of two surfaces is nearer, or on which side of a blocker its light lies.
Everything else is interior and judged strictly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from cases.answers import Answers
from cases.scene import Scene
from cases.stages import Stage
from reports.judge.channels import any_of, dot, length
from reports.judge.conditioning import Conditioning, surface_error
from reports.judge.limits import HIT, Limits, Roundoff
from reports.judge.sides import widest_near


class LightEnd(Protocol):
    """A light near a shape's surface, and the pixels whose view of it hangs on which side of the surface it lies."""

    light: int
    shape: int
    face: int
    gap: float  # m
    pixels: np.ndarray  # (height, width)


class Edges(Protocol):
    """The oracle's distances to the nearest edge [px]; inf where there is none."""

    silhouette: np.ndarray  # (height, width)
    shadow: np.ndarray  # (height, width, lights)
    terminator: np.ndarray  # (height, width, lights)
    gap: np.ndarray  # (height, width) m: along the ray from the hit to the nearest other surface
    behind: np.ndarray  # (height, width): that surface's shape, -1 without one
    light_ends: Sequence[LightEnd]


@dataclass(frozen=True, kw_only=True)
class Classes:
    """Which pixels may differ: bool arrays, and how far [px] an outline may have moved at each pixel."""

    outline: np.ndarray  # (height, width)
    light: np.ndarray  # (height, width, lights)
    reach: np.ndarray  # (height, width) px
    depth: np.ndarray  # (height, width) m: surfaces no farther apart than this along the ray are not told apart
    flagged: np.ndarray  # (height, width): a light lies on the surface here, within rounding
    notes: tuple[str, ...]  # why whole areas are undecided, in sentences

    def edge(self, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) that may differ at `stage` end to end."""
        if stage in (Stage.RAY, Stage.CAMERA):
            return np.zeros_like(self.outline)
        if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
            return self.outline
        return self._lit_edge

    @cached_property
    def undecided(self) -> np.ndarray:
        """Return the pixels (height, width) of which some light is undecided."""
        return any_of(self.light)

    @cached_property
    def _lit_edge(self) -> np.ndarray:
        return self.outline | self.flagged | self.undecided


@dataclass(frozen=True, kw_only=True)
class Unlit:
    """What one precision leaves undecided whatever the parties' shadow epsilons are: most of what classes need."""

    outline: np.ndarray  # (height, width)
    reach: np.ndarray  # (height, width) px
    depth: np.ndarray  # (height, width) m
    flagged: np.ndarray  # (height, width)
    lights: tuple["_Lit", ...]  # none where no light is asked about
    ends: tuple[np.ndarray, ...]  # (height, width) m for each of the edges' light ends: how far off it may seem


@dataclass(frozen=True, kw_only=True)
class _Lit:
    """One light at every pixel (height, width)."""

    cosine: np.ndarray  # |n.l|
    shift: np.ndarray  # m: how far rounding moves a shadow across the light
    shadow: np.ndarray  # px to the nearest shadow's edge
    pixel: np.ndarray  # m that a pixel spans
    undecided: np.ndarray  # bool: the terminator is too near


def unlit(scene: Scene, truth: Answers, edges: Edges, conditioning: Conditioning, limits: Limits, g: Roundoff) -> Unlit:
    """Return what one precision leaves undecided before any shadow epsilon is counted."""
    c = conditioning
    with np.errstate(divide="ignore", invalid="ignore"):
        # An outline shifts by its rays' error and by its points' error seen from the eye. Of the surfaces that meet
        # there the worst counts: what is seen within two pixels, or for something thinner the scene's middling one.
        seen = widest_near(np.where(c.hit, c.point / c.distance, 0.0))
        seen = np.maximum(seen, float(np.median(seen[c.hit])) if np.any(c.hit) else 0.0)
        reach = (limits.end_to_end[Stage.RAY] + g(HIT) * seen) / c.pixel_angle
    depth = _indistinct_depth(scene, truth, edges, c, limits, g)
    flagged = np.zeros(c.hit.shape, dtype=bool)
    lights, ends = [], []
    if scene.lights and Stage.VISIBILITY in truth:
        blocker = _typical_point(truth, c)
        for index, one in enumerate(scene.lights):
            toward = np.asarray(one.position) - truth[Stage.POSITION]
            r = length(toward)
            with np.errstate(divide="ignore", invalid="ignore"):
                cosine = np.abs(dot(toward, truth[Stage.NORMAL])) / r
                # A blocker's own error, thrown from near the light onto the receiver, grows with the distances' ratio.
                throw = np.maximum(1.0, r / np.min(r[c.hit], initial=np.inf))
                lit = _Lit(
                    cosine=cosine,
                    shift=limits.position + g(HIT) * blocker * throw,
                    shadow=edges.shadow[..., index],
                    pixel=c.distance * c.pixel_angle,
                    undecided=(cosine <= limits.cosine[..., index]) | (edges.terminator[..., index] <= reach),
                )
            lights.append(lit)
            flagged |= c.hit & (r <= 4 * limits.position)
        for end in edges.light_ends:
            position = np.asarray(scene.lights[end.light].position, dtype=np.float64)
            shape = scene.shapes[end.shape]
            ends.append(g(HIT) * surface_error(shape, truth[Stage.POSITION], position, face=end.face))
    return Unlit(
        outline=(edges.silhouette <= reach) | (edges.gap <= depth),
        reach=reach,
        depth=depth,
        flagged=flagged,
        lights=tuple(lights),
        ends=tuple(ends),
    )


def classify(
    scene: Scene,
    truth: Answers,
    edges: Edges,
    conditioning: Conditioning,
    limits: Limits,
    g: Roundoff,
    *,
    shadow_epsilon: float | np.ndarray,
    before: Unlit | None = None,
) -> Classes:
    """Return the classes for one precision.

    `shadow_epsilon` [m] is how far the renderer under test itself admits to move or ignore things near a feeler's
    start; a shadow's edge may shift by as much, seen at the light's angle. `before` is the `unlit` of the same, if
    it is known.
    """
    before = before or unlit(scene, truth, edges, conditioning, limits, g)
    c = conditioning
    light = np.zeros((*c.hit.shape, len(scene.lights)), dtype=bool)
    notes = []
    if before.lights:
        # A surface that close to the hit a strategy may leave out, or start its feelers beyond.
        touching = edges.gap <= before.depth + 2 * shadow_epsilon / c.cosine
        for index, one in enumerate(before.lights):
            with np.errstate(divide="ignore", invalid="ignore"):
                shift = (one.shift + 2 * shadow_epsilon) / one.cosine
                near = np.isfinite(one.shadow) & (one.shadow <= shift / one.pixel)
            light[..., index] = c.hit & (near | one.undecided | touching)
        for end, error in zip(edges.light_ends, before.ends, strict=True):
            undecided = end.pixels & (end.gap <= error + 2 * shadow_epsilon)
            light[..., end.light] |= undecided
            if np.any(undecided):
                notes.append(f"light {end.light} lies on shape {end.shape}, within rounding: either it blocks or not")
    return Classes(
        outline=before.outline,
        light=light,
        reach=before.reach,
        depth=before.depth,
        flagged=before.flagged,
        notes=tuple(notes),
    )


def _indistinct_depth(
    scene: Scene, truth: Answers, edges: Edges, c: Conditioning, limits: Limits, g: Roundoff
) -> np.ndarray:
    """Return how far apart [m] along the ray two surfaces may seem for rounding alone: the errors of both distances."""
    depth = limits.end_to_end[Stage.DISTANCE].copy()
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    for index in np.unique(edges.behind[c.hit & (edges.behind >= 0)]):
        here = c.hit & (edges.behind == index)
        other = surface_error(scene.shapes[int(index)], eye, truth[Stage.POSITION][here])
        # Where the two come so near each other, they look along one normal, or an outline between them is near.
        depth[here] += g(HIT) * (other / c.cosine[here] + c.distance[here])
    return depth


def _typical_point(truth: Answers, c: Conditioning) -> float:
    """Return the point error [m per roundoff] of the worst shape, each by the median of what is seen of it.

    Not the largest: an infinite plane's error grows towards its horizon, where it blocks nothing.
    """
    objects = truth[Stage.OBJECT][..., 0]
    return max((float(np.median(c.point[objects == one])) for one in np.unique(objects[c.hit])), default=0.0)
