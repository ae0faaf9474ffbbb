"""`render` and `continue_from`: a scene's stages as NumPy images, from the first stage on or from given stages.

Split kernels give bit-identical results. The time of a single render is mostly compilation, and scenes of different
structure share most of the shorter kernels.
"""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import Lanes
from rayproof.tracer.kernel.parameters import NumbersInMemory, SplitKernels
from rayproof.tracer.light_path import Trace, images
from rayproof.tracer.light_path.camera_stage import Frame
from rayproof.tracer.plan import Plan, plan
from rayproof.tracer.shapes.bounds import beyond


def _numbers(array: Any) -> np.ndarray:
    """Return an evaluated array, or a literal, as float64."""
    return np.array(array, dtype=np.float64)


def _components(scalars: list[Any]) -> np.ndarray:
    """Return literals as float64. One by one: Dr.Jit would launch a kernel to lay a matrix out in memory."""
    return np.array([float(scalar[0]) for scalar in scalars])


def _image(lanes: Lanes, samples: list[tuple[Any, ...]]) -> np.ndarray:
    """Return the image (height, width, channels) of each lane's samples; a literal channel fills its image."""
    channels = [lanes.image([_numbers(channel) for channel in of]) for of in zip(*samples, strict=True)]
    return np.stack(channels, axis=-1) if channels else np.zeros((lanes.height, lanes.width, 0))


def _camera(frame: Frame, corners: list[Any], places: np.ndarray) -> dict[str, np.ndarray]:
    """Return the camera stage (see `cases.stages`) with (sx, sy) and pixel at their places, (height, width, 4)."""
    return {
        **{
            name: _components([getattr(frame, name)[i, j] for i in range(4) for j in range(4)]).reshape(4, 4)
            for name in ("view", "view_inverse", "projection", "projection_inverse")
        },
        "frustum_corners": _components([x for corner in corners for x in corner]).reshape(8, 3),
        "ndc": places[..., :2],
        "pixel": places[..., 2:],
    }


def render(
    scene: Scene,
    stages: Collection[Stage],
    configuration: Configuration,
    *,
    samples: int = 1,
    chosen: Plan | None = None,
) -> StageImages:
    """Return the requested stages (see `cases.stages`) as float64 arrays in every precision.

    With samples > 1, radiance only: the mean over samples x samples points per pixel, the centres of a regular
    subdivision.

    Raises:
        ValueError: samples < 1, a stage other than radiance with samples > 1, or a scene beyond what the precision
            can hold (see `tracer.shapes.bounds`).
        LookupError: a shape that the tracer has no formula for.
        RuntimeError: Dr.Jit has no backend on this machine.

    """
    wanted = [stage for stage in Stage if stage in stages]
    if samples < 1 or (samples > 1 and wanted != [Stage.RADIANCE]):
        raise ValueError(f"samples must be 1, or more for radiance alone; got {samples} for {', '.join(wanted)}")
    refusal = beyond(scene, configuration.precision)
    if refusal is not None:
        raise ValueError(refusal)
    # The requested stages are written to memory anyway, so that the next stage may start from there.
    parameters = SplitKernels() if len(wanted) > 1 else NumbersInMemory()
    trace = Trace.of(scene, configuration, per_side=samples, chosen=chosen, parameters=parameters)
    channels = images(trace, wanted)
    dr.eval(channels)
    answers: StageImages = {stage: _image(trace.view.lanes, channels[stage]) for stage in wanted}
    if samples > 1:
        rows = answers[Stage.RADIANCE].reshape(scene.camera.height, samples, scene.camera.width, samples, -1)
        answers[Stage.RADIANCE] = rows.mean(axis=(1, 3))
    if Stage.CAMERA in answers:
        frame = trace.view.frame
        answers[Stage.CAMERA] = _camera(frame, configuration["corners"](frame), answers[Stage.CAMERA])
    return answers


def continue_from(scene: Scene, stage: Stage, earlier: StageImages, configuration: Configuration) -> np.ndarray:
    """Return an image stage (height, width, channels) computed from the `earlier` ones.

    `earlier` has (height, width, channels) arrays of earlier stages, which are used unchanged; missing stages are
    traced. If the given triangle of a mesh differs from the triangle that the tracer hits, the given triangle's normal
    is used.

    Raises:
        ValueError: a scene beyond what the precision can hold.
        LookupError: a shape that the tracer has no formula for.

    """
    refusal = beyond(scene, configuration.precision)
    if refusal is not None:
        raise ValueError(refusal)
    alone = replace(plan(scene, configuration), columns=1, rows=1, split=False, pipelined=False)
    trace = Trace.of(scene, configuration, per_side=1, chosen=alone, parameters=SplitKernels())
    order, Float = list(Stage), trace.world.types.Float
    uploaded = {
        before: [[Float(channel) for channel in np.asarray(image, dtype=np.float64).reshape(-1, image.shape[-1]).T]]
        for before, image in earlier.items()
        if before is not Stage.CAMERA and order.index(before) < order.index(stage)
    }
    (channels,) = images(trace, [stage], uploaded)[stage]
    dr.eval(channels)
    return _image(trace.view.lanes, [channels])
