"""From rtrace's hits and radiances to the specification's stages."""

from collections.abc import Collection, Iterator

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.radiance.cameras import centers, interval, parts, through
from rayproof.reference.radiance.tracing import Hits, Rays, World

LIT = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE)


def single(scene: Scene, world: World, stages: Collection[Stage]) -> StageImages:
    """Return the stages from ray to exitance that are among `stages`, (height, width, channels), float64."""
    hits = world.hits(_rays(scene, *centers(scene.camera)))
    normal = _shading_normals(scene, hits)
    found: dict[Stage, np.ndarray] = {
        Stage.RAY: hits.direction,
        Stage.OBJECT: np.column_stack([hits.shape, hits.face]).astype(np.float64),
        Stage.DISTANCE: hits.distance[:, np.newaxis],
        Stage.POSITION: hits.position,
        Stage.NORMAL: normal,
    }
    if set(LIT) & set(stages):
        found |= _lit(scene, world, hits, normal)
    size = (scene.camera.lines, scene.camera.width)
    return {stage: rows.reshape(*size, rows.shape[1]) for stage, rows in found.items() if stage in stages}


def image(scene: Scene, world: World, samples: int) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (height, width, 3)."""
    pixels = scene.camera.lines * scene.camera.width
    total = np.zeros((pixels, 3))
    for light in scene.lights:
        for found in world.radiance(light, _portions(scene, samples)):
            total += found.reshape(-1, pixels, 3).sum(axis=0)
    return (total / samples**2).reshape(scene.camera.lines, scene.camera.width, 3)


def _portions(scene: Scene, samples: int) -> Iterator[Rays]:
    for x, y in parts(scene.camera, samples):
        yield _rays(scene, x, y)


def _rays(scene: Scene, x: np.ndarray, y: np.ndarray) -> Rays:
    direction, cosine = through(scene.camera, x, y)
    start, end = interval(scene, cosine)
    return Rays(direction=direction, start=start, end=end)


def _lit(scene: Scene, world: World, hits: Hits, normal: np.ndarray) -> dict[Stage, np.ndarray]:
    """Return visibility, irradiance and exitance."""
    hit = np.flatnonzero(hits.shape >= 0)
    visibility = np.zeros((len(hits.shape), len(scene.lights)))
    irradiance = np.zeros((len(hits.shape), 3))
    for number, light in enumerate(scene.lights):
        arriving = world.irradiance(light, hits.position[hit], normal[hit])
        visibility[hit, number] = arriving > 0
        irradiance[hit] += arriving[:, np.newaxis] * light.flux
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    return {
        Stage.VISIBILITY: visibility,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo[hits.shape] * irradiance,
    }


def _shading_normals(scene: Scene, hits: Hits) -> np.ndarray:
    """Return the specification's N: outward, and on two-sided shapes towards the viewer."""
    two_sided = np.array([*(shape.two_sided for shape in scene.shapes), False])[hits.shape]
    away = (hits.normal * hits.direction).sum(axis=1) > 0
    return np.where((two_sided & away)[:, np.newaxis], -hits.normal, hits.normal)
