"""What each pixel sees, as needed to follow it sideways: the hit's sheet, and the plane of its face."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera_frame import View, pixel_centers, view_of
from rayproof.reference.analytic.edges.inverse_depths import Sheet, ellipsoid_sheet, flat_sheet, no_sheet
from rayproof.reference.analytic.edges.occlusion import Screens, flat_screen, no_screens, polar_screen
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.planes import Flat
from rayproof.reference.analytic.stages import Rows, chain
from rayproof.reference.analytic.surfaces import cube_points, surface_of
from rayproof.reference.analytic.vectors import length


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
            here = np.flatnonzero(self.rows[Stage.OBJECT][rays, 0] == index)
            surface = surface_of(shape)
            if not isinstance(surface, Ellipsoid):
                found = flat_screen(apex, self.points[rays[here]], self.normals[rays[here]])
                screens.normals[here], screens.offsets[here] = found
            elif np.linalg.norm(surface.to_unit @ (apex - surface.center)) > 1:
                normal, offset = polar_screen(apex, surface)
                # A point beyond the polar plane lies on the side turned away: clipping has opened the surface.
                front = here[self.rows[Stage.POSITION][rays[here]] @ normal + offset > 0]
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
        here = np.flatnonzero(rows[Stage.OBJECT][:, 0] == index)
        surface = surface_of(shape)
        if isinstance(surface, Ellipsoid):
            depths = rows[Stage.DISTANCE][here, 0] / length(directions[here])
            sheet[here] = ellipsoid_sheet(view, directions[here], surface, 1 / depths)
            continue
        if isinstance(surface, Flat):
            points[here], normals[here] = surface.point, surface.normal
        else:
            face = np.zeros(len(here), dtype=int)
            if isinstance(shape, Triangle | Mesh):
                face = np.searchsorted(surface.numbers, rows[Stage.OBJECT][here, 1])
            elif isinstance(shape, Cube):
                # The order of `surfaces.CUBE_FACES`.
                local = cube_points(shape, rows[Stage.POSITION][here])
                axis = np.abs(local).argmax(axis=1)
                face = 2 * axis + (np.take_along_axis(local, axis[:, np.newaxis], axis=1)[:, 0] > 0)
            points[here], normals[here] = surface.corners[face, 0], surface.normals[face]
        sheet[here] = flat_sheet(view, directions[here], points[here], normals[here])
    return Hits(scene=scene, view=view, directions=directions, rows=rows, sheet=sheet, points=points, normals=normals)
