"""From what `trace()` found to the specification's stages, ray by ray."""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.povray.probing import Probe


def stages_of(scene: Scene, probe: Probe, objects: np.ndarray, *, lit: bool) -> StageImages:
    """Return every stage before radiance, ray by ray; those of light only if `lit`.

    `objects` (n, 2) are the shape and face that the picture shows. A pixel at an outline that only one of picture and
    trace() hits counts as missed.
    """
    hit = probe.hit & (objects[:, 0] >= 0)
    objects = np.where(hit[:, np.newaxis], objects, -1.0)
    shape = objects[:, 0].astype(int)
    position, outward = (np.where(hit[:, np.newaxis], rows, 0.0) for rows in (probe.position, probe.normal))
    two_sided = np.array([*(each.two_sided for each in scene.shapes), False])[shape]
    away = np.einsum("ij,ij->i", outward, probe.direction) > 0
    normal = np.where((two_sided & away)[:, np.newaxis], -outward, outward)
    distance = np.linalg.norm(position - np.asarray(scene.camera.eye), axis=1)
    rows: StageImages = {
        Stage.RAY: probe.direction,
        Stage.OBJECT: objects,
        Stage.DISTANCE: np.where(hit, distance, np.inf)[:, np.newaxis],
        Stage.POSITION: position,
        Stage.NORMAL: normal,
    }
    return rows | _lit(scene, probe.free, rows) if lit else rows


def _lit(scene: Scene, free: np.ndarray, given: StageImages) -> StageImages:
    """Return visibility, irradiance and exitance from `free` (n, lights) and the stages before them."""
    shape, position, normal = given[Stage.OBJECT][:, 0].astype(int), given[Stage.POSITION], given[Stage.NORMAL]
    visible = np.zeros((len(shape), len(scene.lights)))
    irradiance = np.zeros((len(shape), 3))
    for number, light in enumerate(scene.lights):
        to_light = np.asarray(light.position) - position
        length = np.linalg.norm(to_light, axis=1)
        facing = np.einsum("ij,ij->i", normal, to_light)
        lighted = (shape >= 0) & (facing > 0) & free[:, number]
        visible[:, number] = lighted
        cosine = np.divide(facing, length, out=np.zeros(len(shape)), where=lighted)
        if scene.shading == "inverse_square":
            cosine = np.divide(cosine, 4 * np.pi * length**2, out=np.zeros(len(shape)), where=lighted)
        irradiance += cosine[:, np.newaxis] * np.asarray(light.flux)
    albedo = np.array([*(each.albedo for each in scene.shapes), (0.0, 0.0, 0.0)])[shape]
    return {
        Stage.VISIBILITY: visible,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo * irradiance,
    }
