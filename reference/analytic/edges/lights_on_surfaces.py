"""Lights that lie on a surface, or nearly: the gap to it, and pixels for which rounding decides their side.

The own root is divided out at a feeler's start and not at its end: a light on a blocker's surface is an input that no
algebra excuses. How near it is can be said exactly; what that means to a renderer's precision is the judge's to say.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Cube
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.edges.hits import Hits
from rayproof.reference.analytic.light import above_horizon, blocked
from rayproof.reference.analytic.surfaces import Ellipsoid, Polygons, Surface, surface_of
from rayproof.reference.analytic.vectors import Ends, Flat, cross, dot, ends_of, length

# Of the coordinates: lights farther from a surface than this are told apart by whatever renderer is worth judging.
NEAR = 1e-3


@dataclass(frozen=True, kw_only=True)
class LightEnd:
    """A light near a shape's surface, and the pixels whose view of it hangs on which side of the surface it lies."""

    light: int
    shape: int
    face: int  # the nearest face's number; 0 where the shape has none
    gap: float  # m, a lower bound of the distance between light and surface
    pixels: np.ndarray  # (height, width) bool
    # A feeler may cut a short chord off a curved surface just before the light: how deep [m] below the surface it gets
    # there, at least, and how far [m] before the light it enters; (height, width), 0 where it does not.
    depth: np.ndarray
    chord: np.ndarray


def light_ends(hits: Hits) -> tuple[LightEnd, ...]:
    """Return the lights near surfaces; a pixel is left out where something else blocks the light anyhow."""
    ends = []
    size = (hits.scene.camera.height, hits.scene.camera.width)
    hit = hits.rows[Stage.OBJECT][:, 0] >= 0
    for column, light in enumerate(hits.scene.lights):
        source = np.asarray(light.position, dtype=np.float64)
        surfaces = [surface_of(shape) for shape in hits.scene.shapes]
        gaps = [gaps_to(surface, source) for surface in surfaces]
        # Who does not see the last part of a feeler does not by the feeler's length.
        longest = float(length(hits.rows[Stage.POSITION][hit] - source).max(initial=0))
        limits = [NEAR * max(float(np.abs(source).max()) + _extent(surface), longest) for surface in surfaces]
        near = [index for index, gap in enumerate(gaps) if gap.min(initial=np.inf) <= limits[index]]
        if not near:
            continue
        open_pixels = _open(hits, source, {index: (gaps[index] <= limits[index], limits[index]) for index in near})
        for index in near:
            surface, face = surfaces[index], int(gaps[index].argmin())
            number = int(surface.numbers[face]) if isinstance(surface, Polygons) else 0
            gap = float(gaps[index][face])
            depth, chord = _chords(surface, source, hits.rows[Stage.POSITION] - source)
            others = open_pixels & (hits.rows[Stage.OBJECT][:, 0] != index)
            images = {"pixels": open_pixels, "depth": depth * others, "chord": chord * others}
            ends.append(
                LightEnd(
                    light=column,
                    shape=index,
                    face=number,
                    gap=gap,
                    **{name: image.reshape(size) for name, image in images.items()},
                )
            )
    return tuple(ends)


def _open(hits: Hits, source: np.ndarray, near: dict[int, tuple[np.ndarray, float]]) -> np.ndarray:
    """Return the rays (N,) whose light is above the horizon and blocked by nothing but the faces `near` it.

    `near` has for shapes by index which of their faces are, and how near [m] that is.
    """
    rows = hits.rows
    facing = (rows[Stage.OBJECT][:, 0] >= 0) & above_horizon(source, rows[Stage.POSITION], rows[Stage.NORMAL])
    for index, shape in enumerate(hits.scene.shapes):
        asked = np.flatnonzero(facing)
        objects, positions = rows[Stage.OBJECT][asked], rows[Stage.POSITION][asked]
        if index not in near:
            facing[asked] = ~blocked(hits.scene, index, source, objects, positions)
            continue
        surface, own = surface_of(shape), objects[:, 0] == index
        ends = ends_of(hits.view.eye, positions)
        faces, most = near[index]
        if isinstance(surface, Ellipsoid):
            hidden = _chords(surface, source, positions - source)[0] > most
        else:
            hidden = _blocked_by_the_rest(surface, faces, source, positions - source, ends)
        # A convex shape's point has no other side between it and a light on the same shape.
        one_sided = isinstance(surface, Ellipsoid | Flat) or isinstance(shape, Cube) or len(faces) == 1
        facing[asked] = ~np.where(own & one_sided, False, hidden)
    return facing


def _blocked_by_the_rest(
    surface: Polygons | Flat, near: np.ndarray, source: np.ndarray, segments: np.ndarray, ends: Ends
) -> np.ndarray:
    """Return which segments (N, 3) from the light meet the surface elsewhere than beside the light itself."""
    if isinstance(surface, Flat):
        return np.zeros(len(segments), dtype=bool)
    rest = Polygons(corners=surface.corners[~near], numbers=surface.numbers[~near], closed=surface.closed)
    # A segment that ends on one of these faces ends a rounding before or behind it.
    if not len(rest.corners):
        return np.zeros(len(segments), dtype=bool)
    return rest.blocks(source, segments * (1 - NEAR), ends)


def _chords(surface: Surface, source: np.ndarray, segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how deep [m] below a curved surface, at least, segments (N, 3) from a light on it get, and how far on [m].

    The chord's middle is the deepest place. Nearer the surface than that, a light or a surface moved by rounding has no
    chord there, and is seen.
    """
    nothing = np.zeros(len(segments))
    if not isinstance(surface, Ellipsoid):
        return nothing, nothing
    roots = surface.crossings(source, segments)
    with np.errstate(all="ignore"):
        farther = np.where(np.abs(roots[:, 0]) < np.abs(roots[:, 1]), roots[:, 1], roots[:, 0])
        cut = (farther > 0) & (farther < 1)
        middles = surface.unit_points(source + segments * roots.mean(axis=1, keepdims=True))
        depth = (1 - length(middles)) / np.linalg.norm(surface.to_unit, 2)
        return np.where(cut, np.maximum(depth, 0.0), 0.0), np.where(cut, farther * length(segments), 0.0)


def gaps_to(surface: Surface, point: np.ndarray) -> np.ndarray:
    """Return lower bounds [m] of the distance of a point from each face, shape (faces,)."""
    if isinstance(surface, Flat):
        return np.abs([surface.normal @ (point - surface.point)])
    if isinstance(surface, Ellipsoid):
        # |to_unit (x - center)| changes by at most the map's norm per metre.
        height = np.linalg.norm(surface.to_unit @ (point - surface.center)) - 1
        return np.abs([height]) / np.linalg.norm(surface.to_unit, 2)
    units = surface.normals / length(surface.normals)[:, np.newaxis]
    height = dot(point - surface.corners[:, 0], units)
    along = np.roll(surface.corners, -1, axis=1) - surface.corners
    outward = cross(along, units[:, np.newaxis])
    outward = outward / length(outward)[..., np.newaxis]
    outside = dot(point - surface.corners, outward).max(axis=1, initial=0)
    return np.hypot(height, outside)


def _extent(surface: Surface) -> float:
    """Return the size of a surface's coordinates [m]."""
    if isinstance(surface, Flat):
        return float(np.abs(surface.point).max())
    if isinstance(surface, Ellipsoid):
        return float(np.abs(surface.center).max() + np.linalg.norm(surface.axes, 2))
    return float(np.abs(surface.corners).max(initial=0))
