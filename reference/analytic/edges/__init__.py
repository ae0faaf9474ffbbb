"""`Edges`: for every pixel a lower bound of its distance to the nearest outline, shadow edge, terminator.

Source: the design of this reference; Taylor bounds on implicit equations that are linear or quadratic in the image.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.analytic.edges.hits import (
    Hits,
    clip_depths,
    crossing_distances,
    hits_of,
    meetings_of,
    next_depths,
    undecided_depths,
)
from rayproof.reference.analytic.edges.inverse_depths import Screens
from rayproof.reference.analytic.edges.lights_on_surfaces import LightEnd, gaps_to, light_ends
from rayproof.reference.analytic.edges.outlines import borders_of, edge_distances, ellipsoid_distances, sight_from_eye
from rayproof.reference.analytic.edges.shadows import shadow_distances, terminator_distances
from rayproof.reference.analytic.surfaces import Ellipsoid, surface_of
from rayproof.reference.analytic.vectors import Flat

# Taken off every bound: what float64 may have lost, with room to spare, and far below what a renderer under test loses.
ROUNDING = 1e-9  # px


@dataclass(frozen=True, kw_only=True)
class Edges:
    """Lower bounds [px] of the image distance from each pixel centre to the nearest edge; inf where there is none.

    `shadow` and `terminator` speak of the surface that the pixel sees. Another surface begins at `silhouette`, so what
    a pixel shows is constant within the least of the three. Bounds may be less than the distance, and near many edges
    or on a curved surface they are no more than a few pixels; they tend to the distance as it tends to zero, but for
    edges that something else hides.

    What no distance in the image can say stands beside them: two surfaces that follow each other so closely that
    rounding decides which is nearer, and lights so near to a surface that rounding decides which side they are on.
    """

    silhouette: np.ndarray  # (height, width): the object or face index, or a cube's face, changes
    covered: np.ndarray  # (height, width): the same with edges that what is seen hides by less than float32's rounding
    shadow: np.ndarray  # (height, width, lights): a blocker begins or ends to hide the light
    terminator: np.ndarray  # (height, width, lights): dot(N, L) changes sign
    gap: np.ndarray  # (height, width) m: along the ray from the hit to the nearest other surface; inf without one
    behind: np.ndarray  # (height, width): that surface's shape, -1 without one
    clip_depth: np.ndarray  # (height, width) m: where the ray meets the surface nearest to an end of clipping; or inf
    at_clip: np.ndarray  # (height, width): that surface's shape, -1 without one
    light_ends: tuple[LightEnd, ...]
    eye_gaps: np.ndarray  # (shapes,) m, of each shape: a lower bound of its surface's distance from the eye


def edges_of(scene: Scene) -> Edges:
    """Return the distances to edges of all pixel centres."""
    hits = hits_of(scene)
    size, lights = (scene.camera.height, scene.camera.width), len(scene.lights)
    shadow, terminator = np.zeros((2, *size, lights))
    for column, light in enumerate(scene.lights):
        shadow[..., column] = shadow_distances(hits, light).reshape(size)
        terminator[..., column] = terminator_distances(hits, light).reshape(size)
    screens = hits.screens(hits.view.eye, np.arange(len(hits.directions)), from_eye=True)
    meetings = meetings_of(hits)
    outline, covered = _outline_distances(hits, screens)
    silhouette = np.minimum(outline, crossing_distances(hits, screens, meetings))
    gap, behind = next_depths(hits, meetings)
    # Surfaces that coincide make no outline: what is seen is one of the two, and nothing of the neighbourhood.
    gap = np.where(undecided_depths(hits, gap), 0, gap)
    clip_depth, at_clip = clip_depths(hits, meetings)
    return Edges(
        silhouette=_lowered(silhouette.reshape(size)),
        covered=_lowered(np.minimum(silhouette, covered).reshape(size)),
        shadow=_lowered(shadow),
        terminator=_lowered(terminator),
        gap=gap.reshape(size),
        behind=behind.reshape(size),
        clip_depth=clip_depth.reshape(size),
        at_clip=at_clip.reshape(size),
        light_ends=light_ends(hits),
        eye_gaps=np.array([gaps_to(surface_of(shape), hits.view.eye).min(initial=np.inf) for shape in scene.shapes]),
    )


def _outline_distances(hits: Hits, screens: Screens) -> tuple[np.ndarray, np.ndarray]:
    """Return lower bounds [px] of the distance to the nearest outline or edge that what is hit does not hide, (N,)."""
    sight = sight_from_eye(hits.view, hits.directions)
    distances, covered = np.full((2, len(hits.directions)), np.inf)
    for shape in hits.scene.shapes:
        surface = surface_of(shape)
        if isinstance(surface, Ellipsoid):
            distances = np.minimum(distances, ellipsoid_distances(sight, surface, screens))
        elif not isinstance(surface, Flat):
            borders = borders_of(shape)
            everything = np.ones(len(borders.starts), dtype=bool)
            distances = np.minimum(distances, edge_distances(sight, borders, everything, screens, covered))
    return distances, covered


def _lowered(distances: np.ndarray) -> np.ndarray:
    return np.maximum(distances - ROUNDING, 0)
