"""From Mitsuba's hits and feelers to the specification's stages."""

from collections.abc import Callable, Collection

import numpy as np

from rayproof.cases.scene import Mesh, PointLight, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.mitsuba3.tracing import Feelers, Hits
from rayproof.reference.mitsuba3.worlds import World

Feel = Callable[[World, Hits, PointLight, np.ndarray], Feelers]


def answers(scene: Scene, world: World, hits: Hits, feel: Feel, stages: Collection[Stage]) -> StageImages:
    """Return every stage from ray to exitance that is among `stages`, (height, width, channels), float64."""
    hit = hits.shape >= 0
    distance = np.linalg.norm(hits.position - np.asarray(scene.camera.eye), axis=1)
    normal = _shading_normals(scene, hits)
    found: dict[Stage, np.ndarray] = {
        Stage.RAY: hits.direction,
        Stage.OBJECT: np.column_stack([hits.shape, _faces(scene, world, hits)]),
        # From the eye: Mitsuba's own t starts at the near plane.
        Stage.DISTANCE: np.where(hit, distance, np.inf)[:, np.newaxis],
        Stage.POSITION: hits.position,
        Stage.NORMAL: normal,
    }
    if {Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE} & set(stages):
        found |= _lit(scene, world, hits, normal, feel)
    shape = (scene.camera.lines, scene.camera.width, -1)
    return {
        stage: found[stage].astype(np.float64).reshape(*shape[:2], found[stage].shape[1])
        for stage in stages
        if stage in found
    }


def _lit(scene: Scene, world: World, hits: Hits, normal: np.ndarray, feel: Feel) -> dict[Stage, np.ndarray]:
    """Return visibility, irradiance and exitance."""
    hit = hits.shape >= 0
    visibility = np.zeros((len(hit), len(scene.lights)))
    irradiance = np.zeros((len(hit), 3))
    for number, light in enumerate(scene.lights):
        to_light = np.asarray(light.position) - hits.position
        distance = np.linalg.norm(to_light, axis=1)
        facing = np.einsum("ij,ij->i", normal, to_light)
        above = hit & (facing > 0)
        feelers = feel(world, hits, light, above)
        visibility[:, number] = feelers.free
        cosine = np.divide(facing, distance, out=np.zeros_like(facing), where=feelers.free)
        irradiance += np.where(feelers.free, cosine, 0.0)[:, np.newaxis] * feelers.arriving
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    return {
        Stage.VISIBILITY: visibility,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo[hits.shape] * irradiance,
    }


def _faces(scene: Scene, world: World, hits: Hits) -> np.ndarray:
    """Return the face index: a mesh's triangle, 0 for other shapes, -1 on a miss."""
    faces = np.where(hits.shape >= 0, 0, -1)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Mesh):
            here = hits.shape == index
            faces[here] = world.faces[index][hits.primitive[here]]
    return faces


def _shading_normals(scene: Scene, hits: Hits) -> np.ndarray:
    """Return the specification's N: outward, and on two-sided shapes towards the viewer."""
    two_sided = np.array([*(shape.two_sided for shape in scene.shapes), False])[hits.shape]
    away = np.einsum("ij,ij->i", hits.normal, hits.direction) > 0
    return np.where((two_sided & away)[:, np.newaxis], -hits.normal, hits.normal)
