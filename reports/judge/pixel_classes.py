"""Pixel classes: which pixels are so near an outline, shadow edge, terminator or tie that rounding decides.

The oracle gives a sound lower bound on each pixel's distance to the nearest outline, shadow edge and terminator. A
pixel is `edge` if that distance is within what rounding can shift the edge by, which is derived here, in pixels.
So is one where rounding decides which of two surfaces is nearer, or on which side of a blocker its light lies.
Everything else is interior and judged strictly.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import any_of, widest_near
from rayproof.reports.judge.conditioning import Conditioning, Unrounded
from rayproof.reports.judge.edge_values import Edges
from rayproof.reports.judge.limits import HIT, Limits, Roundoff


@dataclass(frozen=True, kw_only=True)
class Classes:
    """Which pixels may differ: bool arrays, and how far [px] an outline may have moved at each pixel."""

    outline: np.ndarray  # (height, width)
    light: np.ndarray  # (height, width, lights)
    reach: np.ndarray  # (height, width) px
    depth: np.ndarray  # (height, width) m: surfaces no farther apart than this along the ray are not told apart
    # (height, width) m: how far an end of clipping may seem moved, where that decides what is seen; elsewhere 0
    clipped: np.ndarray
    flagged: np.ndarray  # (height, width): a light lies on the surface here, within rounding
    # (height, width) m: how far rounding takes a ray off the flat face in which it runs, between the eye, which is in
    # that face as well, and where clipping begins: along it the face is met anywhere; 0 where no face is so near
    skimming: np.ndarray
    # (shapes,) m: how far rounding takes a surface off the eye that it holds, where nothing is clipped; else 0
    at_eye: np.ndarray
    # (height, width): of these the object, or some light, is undecided by no distance in the image (surfaces that
    # coincide, or hold the eye or a light; a light at the horizon), so that who has one side's value has it by chance.
    object_tied: np.ndarray
    light_tied: np.ndarray
    notes: tuple[str, ...]  # why whole areas are undecided, in sentences

    def edge(self, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) that may differ at `stage` end to end."""
        if stage in (Stage.RAY, Stage.CAMERA):
            return np.zeros_like(self.outline)
        if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
            return self.outline
        return self._lit_edge

    def tied(self, stage: Stage) -> np.ndarray:
        """Return the pixels (height, width) that are edges at `stage` wherever they lie in the image."""
        tied = self.object_tied & self.outline
        return tied if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL) else tied | self.light_tied

    @cached_property
    def undecided(self) -> np.ndarray:
        """Return the pixels (height, width) of which some light is undecided."""
        return any_of(self.light)

    @cached_property
    def _lit_edge(self) -> np.ndarray:
        return self.outline | self.flagged | self.undecided


@dataclass(frozen=True, kw_only=True)
class Unlit:
    """What one precision leaves undecided whatever the renderers' shadow epsilons are: most of what classes need."""

    outline: np.ndarray  # (height, width)
    object_tied: np.ndarray  # (height, width)
    reach: np.ndarray  # (height, width) px
    depth: np.ndarray  # (height, width) m
    clipped: np.ndarray  # (height, width) m
    flagged: np.ndarray  # (height, width)
    skimming: np.ndarray  # (height, width) m
    at_eye: np.ndarray  # (shapes,) m
    lights: tuple["_Lit", ...]  # none where no light is asked about
    ends: tuple[np.ndarray, ...]  # (height, width) m for each of the edges' light ends: how far off it may seem


@dataclass(frozen=True, kw_only=True)
class _Lit:
    """One light at every pixel (height, width)."""

    distance: np.ndarray  # m
    cosine: np.ndarray  # |n.l|
    shift: np.ndarray  # m: how far rounding moves a shadow across the light, and its receiver off its surface
    slide: np.ndarray  # m: how far rounding moves the hit over its surface
    shadow: np.ndarray  # px to the nearest shadow's edge
    pixel: np.ndarray  # m that a pixel spans
    undecided: np.ndarray  # bool: the terminator or the seen face's own edge is too near


def unlit(about: Unrounded, limits: Limits, g: Roundoff) -> Unlit:
    """Return what one precision leaves undecided before any shadow epsilon is counted."""
    c, edges = about.conditioning, about.edges
    with np.errstate(divide="ignore", invalid="ignore"):
        # An outline shifts by its rays' error and by its points' error seen from the eye; clipping's, near it alone.
        seen = g(HIT) * about.seen
        for error, leaning, _ in about.cut:
            angle = error / about.scene.camera.near
            seen = np.maximum(seen, np.where(leaning <= 2 * g(HIT) * angle, g(HIT) * angle, 0.0))
        reach = (limits.end_to_end[Stage.RAY] + seen) / c.pixel_angle
    # How far apart along the ray two surfaces may seem for rounding alone: the errors of both distances.
    depth = limits.end_to_end[Stage.DISTANCE].copy()
    for here, other in about.behind:
        depth[here] += g(HIT) * other
    flagged = np.zeros(c.hit.shape, dtype=bool)
    lights = []
    # What a cube's other faces hide of a light begins where the seen face ends on the way to it, for who makes
    # triangles of it. Rounding alone can sink a hit so far; an epsilon lifts it off the cube or leaves its faces out.
    for index, lamp in enumerate(about.lamps):
        shift = limits.lifted + g(HIT) * about.blocker * lamp.throw
        with np.errstate(divide="ignore", invalid="ignore"):
            sunk = np.isfinite(lamp.brim) & (lamp.brim <= shift + lamp.cosine * limits.position)
            lit = _Lit(
                distance=lamp.distance,
                cosine=lamp.cosine,
                shift=shift,
                slide=limits.position,
                shadow=edges.shadow[..., index],
                pixel=about.pixel,
                undecided=(lamp.cosine <= limits.cosine[..., index]) | (edges.terminator[..., index] <= reach) | sunk,
            )
        lights.append(lit)
        flagged |= c.hit & (lamp.distance <= 4 * limits.position)
    gap, error = about.at_clip
    clipped = np.where(gap <= g(1) * error, g(1) * error, 0.0)
    tied = (edges.gap <= depth) | (clipped > 0)
    # Without clipping a surface that holds the eye is before it or behind it, and seen in every pixel or in none.
    errors = g(HIT) * np.array(about.at_eye)
    holding = edges.eye_gaps <= errors
    if holding.any():
        tied = np.ones_like(tied)
    skimming = np.zeros(tied.shape)
    for error, _, off in about.cut:
        skimming = np.maximum(skimming, np.where(off <= 2 * g(HIT) * error, 2 * g(HIT) * error, 0.0))
    tied = tied | (skimming > 0)
    return Unlit(
        # An edge that what is seen hides by rounding alone may come before it.
        outline=((edges.silhouette if g.precision == "float64" else edges.covered) <= reach) | tied,
        object_tied=tied,
        reach=reach,
        depth=depth,
        clipped=clipped,
        flagged=flagged,
        skimming=skimming,
        at_eye=np.where(holding, errors, 0.0),
        lights=tuple(lights),
        ends=tuple(g(HIT) * error for error in about.ends),
    )


def classify(
    scene: Scene,
    truth: StageImages,
    edges: Edges,
    conditioning: Conditioning,
    limits: Limits,
    g: Roundoff,
    *,
    shadow_epsilon: float | np.ndarray,
    light_epsilon: float = 0.0,
    before: Unlit | None = None,
) -> Classes:
    """Return the classes for one precision.

    `shadow_epsilon` [m] is how far the renderer under test itself admits to move or ignore things near a feeler's
    start; a shadow's edge may shift by as much, seen at the light's angle. `light_epsilon` is the share of a feeler's
    length before the light in which blockers do not count. `before` is the `unlit` of the same, if it is known.
    """
    if before is None:
        about = Unrounded(scene=scene, truth=truth, edges=edges, conditioning=conditioning)
        before = unlit(about, limits, g)
    c = conditioning
    light, tied = np.zeros((*c.hit.shape, len(scene.lights)), dtype=bool), before.flagged.copy()
    notes = []
    if before.lights:
        # A surface that close to the hit a strategy may leave out, or start its feelers beyond.
        touching = edges.gap <= before.depth + 2 * shadow_epsilon / c.cosine
        for index, one in enumerate(before.lights):
            with np.errstate(divide="ignore", invalid="ignore"):
                shift = (one.shift + 2 * shadow_epsilon) / one.cosine + one.slide
                near = np.isfinite(one.shadow) & (one.shadow <= shift / one.pixel)
            light[..., index] = c.hit & (near | one.undecided | touching)
            tied |= c.hit & (one.undecided | touching)
        for end, error in zip(edges.light_ends, before.ends, strict=True):
            blind, moved = light_epsilon * before.lights[end.light].distance, error + 2 * shadow_epsilon
            # A chord of a curved surface just before the light is none if that is off by more than it is deep.
            shallow = (end.depth <= moved) | (end.chord <= blind)
            undecided = end.pixels & (end.gap <= moved + blind) & shallow
            light[..., end.light] |= undecided
            tied |= undecided
            if np.any(undecided):
                notes.append(f"light {end.light} lies on shape {end.shape}, within rounding: either it blocks or not")
    same = ("outline", "object_tied", "reach", "depth", "clipped", "flagged", "skimming", "at_eye")
    known = {name: getattr(before, name) for name in same}
    return Classes(**known, light_tied=tied, light=light, notes=tuple(notes))


def farther(classes: Classes, edges: Edges, c: Conditioning, edge_epsilon: float, tie_epsilon: float) -> Classes:
    """Return classes whose outlines reach farther by a length [m] on the surfaces that are seen within two pixels.

    Surfaces that another length [m] parts along the ray are not told apart either.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = widest_near(np.where(c.hit, 1 / (c.distance * c.pixel_angle), 0.0))
    reach, depth = classes.reach + edge_epsilon * pixels, classes.depth + tie_epsilon
    tied = edges.gap <= depth
    return replace(
        classes,
        reach=reach,
        depth=depth,
        outline=classes.outline | (edges.silhouette <= reach) | tied,
        object_tied=classes.object_tied | tied,
        light=classes.light | tied[..., np.newaxis],
    )


# Which pixels are near an edge, as one small image for people: the classes that judging goes by, kind by kind.


# Bits of a mask; a pixel may be several things.
SILHOUETTE, SHADOW, TERMINATOR, FLAGGED = 1, 2, 4, 8
NAMES = {SILHOUETTE: "silhouette", SHADOW: "shadow edge", TERMINATOR: "terminator", FLAGGED: "light on the surface"}


def mask(classes: "Classes", edges: "Edges") -> np.ndarray:
    """Return uint8 (height, width): the bits of each pixel that may differ; 0 for what is judged strictly.

    A pixel that a light leaves undecided is a shadow edge or a terminator by which of the two is nearer.
    """
    found = np.zeros(classes.outline.shape, np.uint8)
    found[classes.outline] |= SILHOUETTE
    found[classes.flagged] |= FLAGGED
    if classes.light.shape[-1]:
        shadow = edges.shadow < edges.terminator
        found[any_of(classes.light & shadow)] |= SHADOW
        found[any_of(classes.light & ~shadow)] |= TERMINATOR
    return found
