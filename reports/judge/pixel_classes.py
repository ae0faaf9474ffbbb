"""Pixel classes: which pixels are so near an outline, shadow edge, terminator or tie that rounding decides.

The oracle gives a sound lower bound on each pixel's distance to the nearest outline, shadow edge and terminator. A
pixel is `edge` if that distance is within what rounding can shift the edge by, which is derived here, in pixels.
So is one where rounding decides which of two surfaces is nearer, or on which side of a blocker its light lies.
Everything else is interior and judged strictly.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rayproof.cases.placement import placed
from rayproof.cases.scene import Cube, PointLight, Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import any_of, dot, length, widest_near
from rayproof.reports.judge.conditioning import Conditioning, error_at_eye, facing, off_axis, surface_error
from rayproof.reports.judge.edge_values import Edges
from rayproof.reports.judge.limits import HIT, Limits, Roundoff

MOST_FACES = 64  # of a mesh near the eye, whose planes are looked at one by one


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """One light at every pixel (height, width)."""

    distance: np.ndarray  # m
    cosine: np.ndarray  # |n.l|
    throw: np.ndarray  # how many times as large a blocker's own error may be on the receiver
    brim: np.ndarray  # m: how high the way to the light is above a cube's seen face where that ends; elsewhere infinite


@dataclass(frozen=True, kw_only=True)
class Unrounded:
    """A scene, what the oracle answers, and what classes need that follows from them alone, whoever is judged."""

    scene: Scene
    truth: StageImages
    edges: Edges
    conditioning: Conditioning

    def seen(self, *, short: bool) -> np.ndarray:
        """Return the angle [rad per roundoff] (height, width) by which points may seem off from the eye.

        Of the surfaces that meet at an outline the worst counts: what is seen within two pixels, or for something
        thinner the scene's middling one. `short` is `Roundoff.short`.
        """
        c = self.conditioning
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = widest_near(np.where(c.hit, (c.point + c.swollen * short) / c.distance, 0.0))
            return np.maximum(seen, float(np.median(seen[c.hit])) if np.any(c.hit) else 0.0)

    @cached_property
    def behind(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Return for each surface behind what is hit where that is (height, width), and its error [m per roundoff]."""
        c, found = self.conditioning, []
        eye = np.asarray(self.scene.camera.eye, dtype=np.float64)
        for index in np.unique(self.edges.behind[c.hit & (self.edges.behind >= 0)]):
            here = c.hit & (self.edges.behind == index)
            other = surface_error(self.scene.shapes[int(index)], eye, self.truth[Stage.POSITION][here])
            # Where the two come so near each other, they look along one normal, or an outline between them is near.
            found.append((here, other / c.cosine[here] + c.distance[here]))
        return tuple(found)

    @cached_property
    def at_clip(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how far [m] along the ray a surface is from a clip plane, and how far off it may seem there.

        Both (height, width), the second [m per roundoff]. The surface faces as the plane does: one that leans more
        against it crosses it nearby, where it has an outline. Along a coordinate axis its depth is one coordinate of
        its points less the eye's, each carried with two roundings, then the difference, the quotient for t, that for
        the plane, the speed of depth and the plane's own depth with one each: what is 0 rounds nothing. Along another
        axis every coordinate has its share: the way into object space has 7 roundings, of the point and of the ray, and
        the ray's depth 8 more (the axis 5, its product with the ray 3); three are left for quotients and the plane.
        A shell follows a ball about the eye over the whole image; a flat face, touched in one point, is held strictly.
        """
        camera, edges, rays = self.scene.camera, self.edges, self.truth[Stage.RAY]
        gap, error = np.full(edges.at_clip.shape, np.inf), np.zeros(edges.at_clip.shape)
        eye, along = np.asarray(camera.eye, dtype=np.float64), off_axis(camera, rays)
        forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
        axis = np.abs(forward) / np.linalg.norm(forward)
        # Roundings of each coordinate of points, and of rays; and of what has no coordinates.
        points_have, rays_have, rest = (2, 0, 5) if np.count_nonzero(axis) == 1 else (7, 15, 3)
        for index in np.unique(edges.at_clip[edges.at_clip >= 0]):
            here = edges.at_clip == index
            t = edges.clip_depth[here]
            moved = t[:, np.newaxis] * rays[here]
            slope = along[here] if self.scene.clip == "depth" else 1.0
            sizes = points_have * (np.abs(eye + moved) + np.abs(eye)) + rays_have * np.abs(moved)
            error[here] = sizes @ axis / slope + rest * t
            if self.scene.clip == "shell":  # as many roundings as limits of distances count
                shape = self.scene.shapes[int(index)]
                error[here] = 16 * (surface_error(shape, eye, eye + moved) + t) if isinstance(shape, Sphere) else -1.0
            gap[here] = np.minimum(np.abs(t - camera.near / slope), np.abs(t - camera.far / slope))
        return gap, error

    @cached_property
    def at_eye(self) -> tuple[float, ...]:
        """Return how far off [m per roundoff] each shape may seem at the eye; below 0 where clipping hides that."""
        if self.scene.clip != "none":
            return (-1.0,) * len(self.scene.shapes)
        eye = np.asarray(self.scene.camera.eye, dtype=np.float64)
        return tuple(error_at_eye(shape, eye) for shape in self.scene.shapes)

    @cached_property
    def cut(self) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
        """Return by what angle [rad per roundoff] each surface closer to the eye than clipping begins may seem off.

        Where clipping lets it begin, the eye sees it at that distance. Beside it how much [rad] (height, width) each
        ray leans away from the surface more than one that meets it there: a ray at that angle from the surface's plane
        has left it by then, and no part of it is seen. Last how far [m] (height, width) each ray is off the plane of
        one of its flat faces, from the eye to where clipping begins.
        """
        near = self.scene.camera.near
        if self.scene.clip == "none":
            return ()
        eye, rays = np.asarray(self.scene.camera.eye, dtype=np.float64), self.truth[Stage.RAY]
        found = []
        for shape, gap in zip(self.scene.shapes, self.edges.eye_gaps, strict=True):
            if gap < near:
                normals, offsets, bends = facing(shape, eye)
                close = offsets < near
                leaning, off = np.full(rays.shape[:2], np.inf), np.full(rays.shape[:2], np.inf)
                for normal, offset, bend in zip(normals[close], offsets[close], bends[close], strict=True):
                    slope = np.abs(rays @ normal)
                    leaning = np.minimum(leaning, slope - offset / near - near * bend)
                    off = np.minimum(off, np.maximum(offset, near * slope)) if bend == 0 else off
                # Too many to tell apart, or none that is flat enough to have a plane: it may be seen anywhere.
                told = 0 < np.count_nonzero(close) <= MOST_FACES
                found.append((error_at_eye(shape, eye), leaning if told else np.zeros(rays.shape[:2]), off))
        return tuple(found)

    @cached_property
    def blocker(self) -> float:
        """Return the point error [m per roundoff] of the worst shape, each by the median of what is seen of it.

        Not the largest: an infinite plane's error grows towards its horizon, where it blocks nothing.
        """
        c, objects = self.conditioning, self.truth[Stage.OBJECT][..., 0]
        return max((float(np.median(c.point[objects == one])) for one in np.unique(objects[c.hit])), default=0.0)

    @cached_property
    def lamps(self) -> tuple[Lamp, ...]:
        """Return every light, none where no light is asked about."""
        if Stage.VISIBILITY not in self.truth:
            return ()
        return tuple(self._lamp(light) for light in self.scene.lights)

    def _lamp(self, light: PointLight) -> Lamp:
        toward = np.asarray(light.position) - self.truth[Stage.POSITION]
        r = length(toward)
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.abs(dot(toward, self.truth[Stage.NORMAL])) / r
            # A blocker's own error, thrown from near the light onto the receiver, grows with the distances' ratio.
            throw = np.maximum(1.0, r / np.min(r[self.conditioning.hit], initial=np.inf))
        return Lamp(distance=r, cosine=cosine, throw=throw, brim=self._brim(toward, r * cosine))

    def _brim(self, toward: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Return for a light [m] (height, width, 3) away, and so high above a cube's face, its way's height at the end.

        A hit that rounding sinks deeper than that into the cube has the next face before the light.
        """
        brim, objects = np.full(height.shape, np.inf), self.truth[Stage.OBJECT][..., 0]
        for index, shape in enumerate(self.scene.shapes):
            here = objects == index
            if not isinstance(shape, Cube) or not here.any():
                continue
            linear, shift = placed(shape)
            inverse = np.linalg.inv(linear)
            local, way = (self.truth[Stage.POSITION][here] - shift) @ inverse.T, toward[here] @ inverse.T
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = (0.5 * np.sign(way) - local) / way  # of the way to the light, along each axis
            ends[np.arange(len(ends)), np.abs(local).argmax(axis=1)] = np.inf
            ends = np.where(np.isfinite(ends), ends, np.inf).min(axis=1)
            brim[here] = height[here] * np.clip(ends, 0.0, 1.0)
        return brim

    @cached_property
    def ends(self) -> tuple[np.ndarray, ...]:
        """Return for each light near a surface how far off [m per roundoff] (height, width) the surface may seem."""
        if not self.lamps:
            return ()
        found = []
        for end in self.edges.light_ends:
            position = np.asarray(self.scene.lights[end.light].position, dtype=np.float64)
            shape = self.scene.shapes[end.shape]
            found.append(surface_error(shape, self.truth[Stage.POSITION], position, face=end.face))
        return tuple(found)


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
        seen = g(HIT) * about.seen(short=g.short)
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
                pixel=c.distance * c.pixel_angle,
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
