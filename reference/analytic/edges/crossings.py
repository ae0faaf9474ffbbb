"""Distance in the image to where surfaces cross each other in depth, or cross the clip interval's ends."""

from collections.abc import Iterator

import numpy as np

from cases.stages import Stage
from reference.analytic.edges.hits import Hits
from reference.analytic.edges.screens import Screens
from reference.analytic.edges.sheets import Sheet, constant_sheet, ellipsoid_sheet, flat_sheet, shell_sheet
from reference.analytic.ellipsoids import Ellipsoid
from reference.analytic.planes import Flat
from reference.analytic.surfaces import surface_of


def crossing_distances(hits: Hits, screens: Screens) -> np.ndarray:
    """Return a lower bound [px] of the distance to where a surface behind the hit one would come before it.

    A surface before the hit one, or the hit one itself, can only be cut off or uncovered by clipping; a surface behind
    must first cross the hit one. An infinite plane is followed also where the ray does not meet it (w <= 0): it comes
    in from infinity, at its horizon. What lies wholly behind `screens` never crosses the hit surface.
    """
    distances = np.full(len(hits.directions), np.inf)
    ends = _clip_sheets(hits)
    for index in range(len(hits.scene.shapes)):
        for rays, same, sheet in _sheets(hits, screens, index):
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


def _sheets(hits: Hits, screens: Screens, index: int) -> Iterator[tuple[np.ndarray, np.ndarray, Sheet]]:
    """Yield (rays, whether it is the hit itself, sheet) for the crossings with shape `index` that matter."""
    surface = surface_of(hits.scene.shapes[index])
    view, unit = hits.view, hits.rows[Stage.RAY]
    own = hits.rows[Stage.OBJECT][:, 0] == index
    nearest = hits.rows[Stage.DISTANCE][:, 0]
    lengths = np.linalg.norm(hits.directions, axis=1)
    everything = np.arange(len(unit))
    if isinstance(surface, Flat):
        points, normals = (np.broadcast_to(vector, unit.shape) for vector in (surface.point, surface.normal))
        sheet = flat_sheet(view, hits.directions, points, normals)
        if np.isfinite(sheet.value).all():
            yield everything, own, sheet
        return
    if isinstance(surface, Ellipsoid):
        hidden = screens.hides_ellipsoid(surface)
        for roots in surface.crossings(view.eye, unit).T:
            rays = np.flatnonzero((roots > 0) & ~hidden)
            same = own[rays] & (roots[rays] == nearest[rays])
            depths = roots[rays] / lengths[rays]
            yield rays, same, ellipsoid_sheet(view, hits.directions[rays], surface, 1 / depths)
        return
    for bundle, faces, crossings in surface.meetings(view.eye, unit):
        row, column = np.nonzero(crossings > 0)
        kept = ~screens.hides_own_hulls(bundle[row], surface.corners[faces[column]])
        row, column = row[kept], column[kept]
        rays, face = bundle[row], faces[column]
        same = own[rays] & (crossings[row, column] == nearest[rays])
        points, normals = surface.corners[face, 0], surface.normals[face]
        yield rays, same, flat_sheet(view, hits.directions[rays], points, normals)
