"""Images of the wrong size, or with other channels: found before anything is compared, so that nothing is broadcast."""

from collections.abc import Collection
from dataclasses import replace
from typing import TypeVar

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.judge.renderers import Candidate, Witness

Party = TypeVar("Party", Candidate, Witness)


def misshapen(scene: Scene, answers: StageImages | None) -> dict[Stage, str]:
    """Return a reason for each image stage of another size than the camera's; nothing is ever broadcast."""
    size, lights = (scene.camera.height, scene.camera.width), len(scene.lights)
    right = {stage: (*size, len(exr_channels(stage, lights=lights))) for stage in IMAGE_STAGES}
    return {
        stage: f"{stage} has shape {np.shape(image)}, not {right[stage]}"
        for stage, image in (answers or {}).items()
        if stage in right and np.shape(image) != right[stage]
    }


def without(party: Party, stages: Collection[Stage]) -> Party:
    """Return the party without the answers of some stages."""
    if party.answers is None or not stages:
        return party
    return replace(party, answers={stage: image for stage, image in party.answers.items() if stage not in stages})


def well_shaped(scene: Scene, party: Party) -> Party:
    """Return the party without the images that are no answer to the scene."""
    return without(party, misshapen(scene, party.answers))
