"""What each pixel hits, its plane or ellipsoid, the next hits in depth, and depths that clipping leaves undecided."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import View, pixel_centers, view_of
from rayproof.reference.analytic.edges.inverse_depths import (
    Screens,
    Sheet,
    constant_sheet,
    ellipsoid_sheet,
    flat_screen,
    flat_sheet,
    no_screens,
    no_sheet,
    polar_screen,
    shell_sheet,
)
from rayproof.reference.analytic.stages import Rows, chain, clip_interval
from rayproof.reference.analytic.surfaces import Ellipsoid, Polygons, cube_points, surface_of
from rayproof.reference.analytic.vectors import Flat, length


@dataclass(frozen=True, kw_only=True)
class Hits:
    """The rays through the pixel centres, every stage up to the normal, and the hit surface around each point."""

    scene: Scene
    view: View
    directions: np.ndarray  # (N, 3) of depth 1
    rows: Rows
    sheet: Sheet  # w = 0 on a miss
    points: np.ndarray  # (N, 3) m, a point of the hit face's plane
    normals: np.ndarray  # (N, 3) geometric normal of the hit face, of any length; 0 on an ellipsoid

    def of(self, index: int) -> np.ndarray:
        """Return the rays that hit shape `index`."""
        return np.flatnonzero(self.rows[Stage.OBJECT][:, 0] == index)

    def screens(self, apex: np.ndarray, rays: np.ndarray, *, from_eye: bool) -> Screens:
        """Return what the hit surface hides from an apex in front of it, or keeps from standing before it."""
        screens = no_screens(len(rays), hides_touching=not from_eye)
        for index, shape in enumerate(self.scene.shapes):
            members = np.flatnonzero(self.rows[Stage.OBJECT][rays, 0] == index)
            surface = surface_of(shape)
            if not isinstance(surface, Ellipsoid):
                planes = flat_screen(apex, self.points[rays[members]], self.normals[rays[members]])
                screens.normals[members], screens.offsets[members] = planes
            elif np.linalg.norm(surface.to_unit @ (apex - surface.center)) > 1:
                normal, offset = polar_screen(apex, surface)
                # A point beyond the polar plane lies on the side turned away: clipping has opened the surface.
                front = members[self.rows[Stage.POSITION][rays[members]] @ normal + offset > 0]
                screens.normals[front], screens.offsets[front] = normal, offset
        return screens


def hits_of(scene: Scene, points: np.ndarray | None = None) -> Hits:
    """Return what image points (N, 2) [px] see, by default the pixel centres."""
    view = view_of(scene.camera)
    centers = pixel_centers(scene.camera) if points is None else points
    directions = view.directions(centers)
    rows = chain(scene, centers, Stage.NORMAL)
    points, normals = np.zeros_like(directions), np.zeros_like(directions)
    sheet = no_sheet(len(centers))
    for index, shape in enumerate(scene.shapes):
        members = np.flatnonzero(rows[Stage.OBJECT][:, 0] == index)
        surface = surface_of(shape)
        if isinstance(surface, Ellipsoid):
            depths = rows[Stage.DISTANCE][members, 0] / length(directions[members])
            sheet[members] = ellipsoid_sheet(view, directions[members], surface, 1 / depths)
            continue
        if isinstance(surface, Flat):
            points[members], normals[members] = surface.point, surface.normal
        else:
            face = np.zeros(len(members), dtype=int)
            if isinstance(shape, Triangle | Mesh):
                face = np.searchsorted(surface.numbers, rows[Stage.OBJECT][members, 1])
            elif isinstance(shape, Cube):
                # The order of `surfaces.CUBE_FACES`.
                local = cube_points(shape, rows[Stage.POSITION][members])
                axis = np.abs(local).argmax(axis=1)
                face = 2 * axis + (np.take_along_axis(local, axis[:, np.newaxis], axis=1)[:, 0] > 0)
            points[members], normals[members] = surface.corners[face, 0], surface.normals[face]
        sheet[members] = flat_sheet(view, directions[members], points[members], normals[members])
    return Hits(scene=scene, view=view, directions=directions, rows=rows, sheet=sheet, points=points, normals=normals)


# Every crossing of the camera rays with every shape, near or far, and how closely two of them follow each other.


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
    meetings = []
    eye, unit = hits.view.eye, hits.rows[Stage.RAY]
    everything = np.arange(len(unit))
    for index, shape in enumerate(hits.scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, Flat):
            meetings.append(_meeting(hits, index, everything, np.zeros_like(everything), surface.crossing(eye, unit)))
        elif isinstance(surface, Ellipsoid):
            for roots in surface.crossings(eye, unit).T:
                rays = np.flatnonzero(roots > 0)
                meetings.append(_meeting(hits, index, rays, np.zeros_like(rays), roots[rays]))
        else:
            for bundle, faces, crossings in surface.meetings(eye, unit):
                row, column = np.nonzero(crossings > 0)
                meetings.append(_meeting(hits, index, bundle[row], faces[column], crossings[row, column]))
    return meetings


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


# Distance in the image to where surfaces cross each other in depth, or cross the clip interval's ends.


def crossing_distances(hits: Hits, screens: Screens, meetings: Sequence[Meeting]) -> np.ndarray:
    """Return a lower bound [px] of the distance to where a surface behind the hit one would come before it.

    A surface before the hit one, or the hit one itself, can only be cut off or uncovered by clipping; a surface behind
    must first cross the hit one. An infinite plane is followed also where the ray does not meet it (w <= 0): it comes
    in from infinity, at its horizon. What lies wholly behind `screens` never crosses the hit surface.
    """
    distances = np.full(len(hits.directions), np.inf)
    ends = _clip_sheets(hits)
    for meeting in meetings:
        rays, same, sheet = _sheet(hits, screens, meeting)
        hit = hits.sheet[rays]
        missed = hits.rows[Stage.OBJECT][rays, 0] < 0
        behind = ~same & ~missed & (sheet.value < hit.value)
        found = np.where(behind, sheet.meets(hit), np.inf)
        for end in ends:
            found = np.minimum(found, np.where(behind, np.inf, sheet.meets(end[rays])))
        np.minimum.at(distances, rays, found)
    return distances


def _clip_sheets(hits: Hits) -> list[Sheet]:
    """Return the clip interval's ends as surfaces; without clipping only infinity, where planes end."""
    camera, count = hits.scene.camera, len(hits.directions)
    if hits.scene.clip == "none":
        return [constant_sheet(count, 0.0)]
    if hits.scene.clip == "depth":
        return [constant_sheet(count, 1 / camera.near), constant_sheet(count, 1 / camera.far)]
    return [shell_sheet(hits.view, hits.directions, radius) for radius in (camera.near, camera.far)]


def _sheet(hits: Hits, screens: Screens, meeting: Meeting) -> tuple[np.ndarray, np.ndarray, Sheet]:
    """Return (rays, whether it is the hit itself, sheet) of the crossings that matter."""
    surface, view = surface_of(hits.scene.shapes[meeting.shape]), hits.view
    if isinstance(surface, Flat):
        points, normals = (np.broadcast_to(vector, hits.directions.shape) for vector in (surface.point, surface.normal))
        sheet = flat_sheet(view, hits.directions, points, normals)
        if np.isfinite(sheet.value).all():
            return meeting.rays, meeting.same, sheet
        # The eye lies in the plane itself, which then shows as a line.
        kept = np.zeros(0, dtype=int)
        return kept, meeting.same[kept], sheet[kept]
    kept = meeting.distances > 0
    if isinstance(surface, Polygons):
        kept &= ~screens.hides_own_hulls(meeting.rays, surface.corners[meeting.faces])
    else:
        kept &= ~screens.hides_ellipsoid(surface)[meeting.rays]
    rays, faces, same = meeting.rays[kept], meeting.faces[kept], meeting.same[kept]
    directions = hits.directions[rays]
    if isinstance(surface, Ellipsoid):
        depths = meeting.distances[kept] / length(directions)
        return rays, same, ellipsoid_sheet(view, directions, surface, 1 / depths)
    return rays, same, flat_sheet(view, directions, surface.corners[faces, 0], surface.normals[faces])
