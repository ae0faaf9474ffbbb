"""Every crossing of the camera rays with every shape, near or far, and how closely two of them follow each other."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Mesh, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.edges.hits import Hits
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.nearest import clip_interval
from rayproof.reference.analytic.planes import Flat
from rayproof.reference.analytic.polygons import Polygons
from rayproof.reference.analytic.surfaces import surface_of

# Of eye and distance: crossings closer than this float64 itself may have in either order, with room to spare.
SAME_DEPTH = 1e-12


@dataclass(frozen=True, kw_only=True)
class Meeting:
    """Crossings of rays with one shape; all arrays have one entry a crossing."""

    shape: int
    rays: np.ndarray  # (n,) which ray
    faces: np.ndarray  # (n,) which of the surface's faces; 0 where it has none
    distances: np.ndarray  # (n,) m along the unit direction; a plane's also where it is not met
    same: np.ndarray  # (n,) whether it is the hit itself


def meetings_of(hits: Hits) -> list[Meeting]:
    """Return all crossings, one or more entries for each shape that is met at all."""
    found = []
    eye, unit = hits.view.eye, hits.rows[Stage.RAY]
    everything = np.arange(len(unit))
    for index, shape in enumerate(hits.scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, Flat):
            found.append(_meeting(hits, index, everything, np.zeros_like(everything), surface.crossing(eye, unit)))
        elif isinstance(surface, Ellipsoid):
            for roots in surface.crossings(eye, unit).T:
                rays = np.flatnonzero(roots > 0)
                found.append(_meeting(hits, index, rays, np.zeros_like(rays), roots[rays]))
        else:
            for bundle, faces, crossings in surface.meetings(eye, unit):
                row, column = np.nonzero(crossings > 0)
                found.append(_meeting(hits, index, bundle[row], faces[column], crossings[row, column]))
    return found


def _meeting(hits: Hits, index: int, rays: np.ndarray, faces: np.ndarray, distances: np.ndarray) -> Meeting:
    own, surface = hits.rows[Stage.OBJECT][rays, 0] == index, surface_of(hits.scene.shapes[index])
    if not isinstance(surface, Flat):
        own &= distances == hits.rows[Stage.DISTANCE][rays, 0]
    if isinstance(hits.scene.shapes[index], Triangle | Mesh):
        # Of faces that coincide only the one that is named is the hit itself.
        assert isinstance(surface, Polygons)
        own &= surface.numbers[faces] == hits.rows[Stage.OBJECT][rays, 1]
    return Meeting(shape=index, rays=rays, faces=faces, distances=distances, same=own)


def next_depths(hits: Hits, meetings: list[Meeting]) -> tuple[np.ndarray, np.ndarray]:
    """Return how far [m] along the ray the nearest other crossing lies from the hit (N,), and with which shape (N,).

    Infinite, and -1, without one and on a miss. What clipping takes away counts. The two sides of one ellipsoid do not,
    for they look the same where they meet.
    """
    nearest, objects = hits.rows[Stage.DISTANCE][:, 0], hits.rows[Stage.OBJECT][:, 0]
    gaps, shapes = np.full(len(nearest), np.inf), np.full(len(nearest), -1)
    for meeting in meetings:
        rays = meeting.rays
        other = ~meeting.same & (meeting.distances > 0) & np.isfinite(meeting.distances) & (objects[rays] >= 0)
        if isinstance(surface_of(hits.scene.shapes[meeting.shape]), Ellipsoid):
            other &= objects[rays] != meeting.shape
        rays, apart = rays[other], np.abs(meeting.distances[other] - nearest[rays[other]])
        np.minimum.at(gaps, rays, apart)
        shapes[rays[apart == gaps[rays]]] = meeting.shape
    return gaps, shapes


def clip_depths(hits: Hits, meetings: list[Meeting]) -> tuple[np.ndarray, np.ndarray]:
    """Return where [m] along the ray the surface nearest to an end of clipping is met (N,), and its shape (N,).

    Infinite, and -1, where nothing is clipped or met. A surface counts on both sides of the end.
    """
    gaps, depths, shapes = *np.full((2, len(hits.directions)), np.inf), np.full(len(hits.directions), -1)
    if hits.scene.clip == "none":
        return depths, shapes
    ends = clip_interval(hits.scene, hits.rows[Stage.RAY])
    for meeting in meetings:
        met = (meeting.distances > 0) & np.isfinite(meeting.distances)
        rays = meeting.rays[met]
        apart = np.min([np.abs(meeting.distances[met] - end[rays]) for end in ends], axis=0)
        np.minimum.at(gaps, rays, apart)
        nearest = apart == gaps[rays]
        depths[rays[nearest]], shapes[rays[nearest]] = meeting.distances[met][nearest], meeting.shape
    return depths, shapes


def undecided_depths(hits: Hits, gaps: np.ndarray) -> np.ndarray:
    """Return the rays (N,) on which float64's own rounding decides which of two surfaces is nearer."""
    reach = np.abs(hits.view.eye).max() + hits.rows[Stage.DISTANCE][:, 0]
    return np.isfinite(gaps) & (gaps <= SAME_DEPTH * reach)
