"""The camera on the device: everything that belongs to the camera and not to a pixel, computed once and as literals."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from rayproof.cases.scene import Camera
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import KernelConstants


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A camera by the formulas of a configuration and in its precision."""

    eye: Any  # m
    target: Any  # the point looked at, m
    near: Any  # depth of the near plane, m
    far: Any  # m
    right: Any  # the axis R
    up: Any  # the axis U
    forward: Any  # the axis F
    horizontal: Any  # the image's half-width at depth 1
    vertical: Any  # its half-height there
    view: Any  # world -> camera
    view_inverse: Any
    projection: Any  # camera -> clip
    projection_inverse: Any


def camera_frame(
    camera: Camera, configuration: Configuration, types: ArrayTypes, *, half_extent: tuple[Any, Any] | None = None
) -> Frame:
    """Return the frame of a camera; `half_extent` takes the place of what fovy and aspect give."""
    eye, target = types.Vector(*camera.eye), types.Vector(*camera.target)
    near, far = types.Float(camera.near), types.Float(camera.far)
    right, up, forward = configuration["basis"](eye, target, types.Vector(*camera.up))
    horizontal, vertical = half_extent or configuration["half_extent"](types.Float, camera.fovy, camera.aspect)
    view = configuration["view"](eye, right, up, forward)
    projection = configuration["projection"](horizontal, vertical, near, far)
    return Frame(
        eye=eye,
        target=target,
        near=near,
        far=far,
        right=right,
        up=up,
        forward=forward,
        horizontal=horizontal,
        vertical=vertical,
        view=view,
        view_inverse=configuration["inverse"](view),
        projection=projection,
        projection_inverse=configuration["inverse"](projection),
    )


class Viewpoint:
    """A frame as the rays' formulas see it: its numbers as parameters of the kernel, each once it is asked for."""

    def __init__(self, frame: Frame, parameters: KernelConstants) -> None:
        self._frame, self._parameters = frame, parameters

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._frame, name)
        return self._parameters(f"camera {name}", value) if dr.is_array_v(value) else value
