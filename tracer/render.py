"""Render a scene: the stages that were asked for, in one fused kernel."""

from collections.abc import Collection
from typing import Any

import drjit as dr
import numpy as np

from cases.answers import Answers
from cases.scene import Scene
from cases.stages import Stage
from tracer.configuration import Configuration
from tracer.reach import beyond
from tracer.trace import Trace


def _numbers(array: Any) -> np.ndarray:
    """Return an evaluated array, or a literal, as float64."""
    return np.array(array, dtype=np.float64)


def _components(scalars: list[Any]) -> np.ndarray:
    """Return literals as float64. One by one: Dr.Jit would launch a kernel to lay a matrix out in memory."""
    return np.array([float(scalar[0]) for scalar in scalars])


def _image(channels: tuple[Any, ...], *, height: int, width: int) -> np.ndarray:
    """Return (height, width, channels); a literal channel fills its image."""
    flat = [np.broadcast_to(_numbers(channel), (height * width,)) for channel in channels]
    return np.stack(flat, axis=-1).reshape(height, width, -1) if flat else np.zeros((height, width, 0))


def _pixels(trace: Trace) -> tuple[Any, Any]:
    camera = trace.scene.camera
    return trace.configuration["pixel"](*trace.ndc, camera.width, camera.height)


def _camera(trace: Trace, pixels: tuple[Any, ...]) -> dict[str, np.ndarray]:
    """Return the camera stage (see `cases.answers`)."""
    frame, camera = trace.frame, trace.scene.camera
    size = {"height": camera.height, "width": camera.width}
    return {
        **{
            name: _components([getattr(frame, name)[i, j] for i in range(4) for j in range(4)]).reshape(4, 4)
            for name in ("view", "view_inverse", "projection", "projection_inverse")
        },
        "frustum_corners": _components([x for corner in frame.corners for x in corner]).reshape(8, 3),
        "ndc": _image(trace.ndc, **size),
        "pixel": _image(pixels, **size),
    }


def render(scene: Scene, stages: Collection[Stage], configuration: Configuration, *, samples: int = 1) -> Answers:
    """Return the stages asked for (see `cases.answers`), whatever the precision as float64.

    With samples > 1, radiance only: the mean over samples x samples points per pixel, the centres of a regular
    subdivision.

    Raises:
        ValueError: samples < 1, a stage other than radiance with samples > 1, or a scene beyond what the precision
            can hold (see `tracer.reach`).
        LookupError: a shape that the tracer has no formula for.
        RuntimeError: Dr.Jit has no backend on this machine.

    """
    wanted = [stage for stage in Stage if stage in stages]
    if samples < 1 or (samples > 1 and wanted != [Stage.RADIANCE]):
        raise ValueError(f"samples must be 1, or more for radiance alone; got {samples} for {', '.join(wanted)}")
    refusal = beyond(scene, configuration.precision)
    if refusal is not None:
        raise ValueError(refusal)
    trace = Trace(scene, configuration, per_side=samples)
    images = {stage: trace.channels(stage) for stage in wanted if stage is not Stage.CAMERA}
    pixels = _pixels(trace) if Stage.CAMERA in wanted else ()
    ndc = trace.ndc if Stage.CAMERA in wanted else ()
    dr.eval(list(images.values()), pixels, ndc)
    width, height = scene.camera.width * samples, scene.camera.height * samples
    answers: Answers = {}
    for stage in wanted:
        if stage is Stage.CAMERA:
            answers[stage] = _camera(trace, pixels)
            continue
        image = _image(images[stage], height=height, width=width)
        if samples > 1:
            image = image.reshape(scene.camera.height, samples, scene.camera.width, samples, -1).mean(axis=(1, 3))
        answers[stage] = image
    return answers
