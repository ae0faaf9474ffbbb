"""Images of the wrong size: found before anything is compared, so that nothing is ever broadcast."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from cases.scene import Scene
from cases.stages import Stage
from reports.judge.parties import Candidate


def misshapen(scene: Scene, candidate: Candidate) -> dict[Stage, str]:
    """Return a reason for each image stage of another size than the camera's; nothing is ever broadcast."""
    size = (scene.camera.height, scene.camera.width)
    return {
        stage: f"{stage} has shape {np.shape(image)}, not {size} and channels"
        for stage, image in (candidate.answers or {}).items()
        if stage is not Stage.CAMERA and (np.ndim(image) != 3 or np.shape(image)[:2] != size)
    }


def without(candidate: Candidate, stages: Collection[Stage]) -> Candidate:
    """Return the candidate without the answers of some stages."""
    if candidate.answers is None or not stages:
        return candidate
    return replace(
        candidate, answers={stage: image for stage, image in candidate.answers.items() if stage not in stages}
    )
