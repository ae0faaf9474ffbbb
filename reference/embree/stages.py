"""From Embree's hits to the specification's stages."""

from collections.abc import Collection

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.embree.cameras import directions, interval
from rayproof.reference.embree.facets import facets
from rayproof.reference.embree.tracing import World

# A feeler starts this fraction of its hit's distance from the eye ahead: 32 roundings of the hit point to float32,
# which is how far Embree may see a surface from where it is.
CLEARANCE = 32 * 2.0**-24


def rays(scene: Scene) -> np.ndarray:
    """Return the unit directions through the pixel centres, (height, width, 3)."""
    return directions(scene.camera)[0].reshape(scene.camera.lines, scene.camera.width, 3)


def answers(scene: Scene, stages: Collection[Stage]) -> StageImages:
    """Return those stages from object to visibility that are among `stages`, (height, width, channels), float64."""
    direction, depth = directions(scene.camera)
    world = World(facets(scene))
    hit, distance = world.nearest(direction, *interval(scene, depth))
    seen = np.flatnonzero(hit >= 0)
    objects, position, normal = np.full((len(hit), 2), -1.0), np.zeros((len(hit), 3)), np.zeros((len(hit), 3))
    objects[seen] = np.column_stack([world.facets.shape[hit[seen]], world.facets.face[hit[seen]]])
    # Relative to the eye, as everything that is traced here.
    position[seen] = distance[seen, np.newaxis] * direction[seen]
    normal[seen] = _shading_normals(scene, world, hit[seen], direction[seen])
    visibility = np.zeros((len(hit), len(scene.lights)))
    if Stage.VISIBILITY in stages:
        visibility[seen] = _visible(scene, world, position[seen], normal[seen], distance[seen])
    found = {
        Stage.OBJECT: objects,
        Stage.DISTANCE: distance[:, np.newaxis],
        Stage.POSITION: np.where((hit >= 0)[:, np.newaxis], position + scene.camera.eye, 0.0),
        Stage.NORMAL: normal,
        Stage.VISIBILITY: visibility,
    }
    size = (scene.camera.lines, scene.camera.width)
    return {stage: rows.reshape(*size, rows.shape[1]) for stage, rows in found.items() if stage in stages}


def _shading_normals(scene: Scene, world: World, hit: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the specification's N (n, 3): outward, and on two-sided shapes towards the viewer."""
    outward = world.facets.normal[hit]
    two_sided = np.array([shape.two_sided for shape in scene.shapes], dtype=bool)[world.facets.shape[hit]]
    away = np.einsum("ij,ij->i", outward, direction) > 0
    return np.where((two_sided & away)[:, np.newaxis], -outward, outward)


def _visible(scene: Scene, world: World, position: np.ndarray, normal: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Return 1 per light above the horizon and unobstructed, else 0, (n, lights); positions relative to the eye."""
    visible = np.zeros((len(position), len(scene.lights)))
    for number, light in enumerate(scene.lights):
        place = np.subtract(light.position, scene.camera.eye)
        above = np.flatnonzero(np.einsum("ij,ij->i", normal, place - position) > 0)
        free = ~world.blocked(position[above], place, CLEARANCE * distance[above])
        visible[above[free], number] = 1.0
    return visible
