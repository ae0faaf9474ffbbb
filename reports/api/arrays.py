"""Images from whatever array library a renderer is written in, as float64 of the shape that a stage has."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.api.asking import image_stages


def answers_from(given: Any, scene: Scene, stages: tuple[Stage, ...]) -> dict[Stage, np.ndarray]:
    """Return what a renderer gave as stage -> float64 (height, width, channels).

    `given` maps stage names to arrays: NumPy's, or anything that speaks DLPack (PyTorch, JAX, Dr.Jit) or that NumPy
    understands. Where one stage alone was asked for it may be the array itself.

    Raises:
        TypeError: it is no mapping, or something in it is no array of numbers.
        ValueError: an array has another shape than (height, width, channels of the stage), or a stage is not known.

    """
    if not isinstance(given, Mapping):
        if len(stages) != 1:
            raise TypeError(f"expected a mapping from stage to array, got {type(given).__name__}")
        given = {stages[0].value: given}
    found = {}
    for stage in image_stages([str(name) for name in given]):
        size = (scene.camera.height, scene.camera.width, len(exr_channels(stage, lights=len(scene.lights))))
        found[stage] = _image(given[stage], stage, size)
    return found


def _image(value: Any, stage: Stage, size: tuple[int, int, int]) -> np.ndarray:
    image = _array(value, stage)
    if size[2] == 1 and image.shape == size[:2]:
        image = image[..., np.newaxis]
    if image.shape != size:
        swapped = image.ndim == 2 and image.shape == (size[2], size[0] * size[1])
        hint = f"; components come first in it: transpose it and reshape it to {size}" if swapped else ""
        raise ValueError(f"{stage} must have shape {size} = (height, width, channels), got {image.shape}{hint}")
    return image


def _array(value: Any, stage: Stage) -> np.ndarray:
    """Return a float64 copy of an array of any library."""
    value = value.detach() if hasattr(value, "detach") else value  # PyTorch gives away no array that has a gradient
    if isinstance(value, list | tuple | np.ndarray) or not hasattr(value, "__dlpack__"):
        found = value
    else:
        try:
            found = np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError, AttributeError):
            found = (
                value  # on a graphics card, or of a type that DLPack has no word for: the library may copy it itself
            )
    try:
        return np.array(found, dtype=np.float64)
    except Exception as error:  # whatever an array library raises
        line = " ".join(str(error).split())
        raise TypeError(f"{stage} is no array of numbers: {type(value).__name__} ({line})") from error
