"""Distance in the image to where surfaces cross each other in depth, or cross the clip interval's ends."""

from collections.abc import Sequence

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.analytic.edges.hits import Hits
from rayproof.reference.analytic.edges.inverse_depths import (
    Sheet,
    constant_sheet,
    ellipsoid_sheet,
    flat_sheet,
    shell_sheet,
)
from rayproof.reference.analytic.edges.meetings import Meeting
from rayproof.reference.analytic.edges.occlusion import Screens
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.planes import Flat
from rayproof.reference.analytic.polygons import Polygons
from rayproof.reference.analytic.surfaces import surface_of
from rayproof.reference.analytic.vectors import length


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
