"""How far the tracer admits to move a feeler's start, pixel by pixel, from the hit that each pixel made."""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.light_path.shadow_stage import shadow_epsilon
from rayproof.tracer.shapes.primitives import traced


def shadow_epsilons(scene: Scene, answers: StageImages, configuration: Configuration) -> np.ndarray:
    """Return the configuration's shadow epsilon [m], (height, width).

    It goes by the coordinates at hand and by how the shape hit magnifies rounding: a sliver's own face counts, not the
    worst face of its mesh.
    """
    coordinates = np.maximum(np.abs(answers[Stage.POSITION]).max(axis=-1), np.abs(scene.camera.eye).max())
    spreads = np.ones(coordinates.shape)
    objects, faces = answers[Stage.OBJECT][..., 0], answers[Stage.OBJECT][..., 1].astype(int)
    for index, shape in enumerate(scene.shapes):
        seen = objects == index
        spreads[seen] = traced(shape).spreads()[faces[seen]]
    return shadow_epsilon(configuration, scale=coordinates, spread=spreads)
