"""The camera on the device: everything that belongs to the camera and not to a pixel, computed once and as literals."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.cases.scene import Camera
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.device.kernel_constants import KernelConstants


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A camera, the formulas that it is to be computed by and the precision; what is not asked for is not computed."""

    camera: Camera
    configuration: Configuration
    types: ArrayTypes

    @cached_property
    def eye(self) -> Any:
        """Return the eye [m]."""
        return self.types.Vector(*self.camera.eye)

    @cached_property
    def target(self) -> Any:
        """Return the point looked at [m]."""
        return self.types.Vector(*self.camera.target)

    @cached_property
    def near(self) -> Any:
        """Return the depth of the near plane [m]."""
        return self.types.Float(self.camera.near)

    @cached_property
    def far(self) -> Any:
        """Return the depth of the far plane [m]."""
        return self.types.Float(self.camera.far)

    @cached_property
    def _axes(self) -> tuple[Any, Any, Any]:
        return self.configuration["basis"](self.eye, self.target, self.types.Vector(*self.camera.up))

    @cached_property
    def right(self) -> Any:
        """Return the axis R."""
        return self._axes[0]

    @cached_property
    def up(self) -> Any:
        """Return the axis U."""
        return self._axes[1]

    @cached_property
    def forward(self) -> Any:
        """Return the axis F."""
        return self._axes[2]

    @cached_property
    def _half_extent(self) -> tuple[Any, Any]:
        return self.configuration["half_extent"](self.types.Float, self.camera.fovy, self.camera.aspect)

    @cached_property
    def horizontal(self) -> Any:
        """Return the image's half-width at depth 1."""
        return self._half_extent[0]

    @cached_property
    def vertical(self) -> Any:
        """Return the image's half-height at depth 1."""
        return self._half_extent[1]

    @cached_property
    def view(self) -> Any:
        """Return world -> camera."""
        return self.configuration["view"](self.eye, self.right, self.up, self.forward)

    @cached_property
    def view_inverse(self) -> Any:
        """Return camera -> world."""
        return self.configuration["inverse"](self.view)

    @cached_property
    def projection(self) -> Any:
        """Return camera -> clip."""
        return self.configuration["projection"](self.horizontal, self.vertical, self.near, self.far)

    @cached_property
    def projection_inverse(self) -> Any:
        """Return clip -> camera."""
        return self.configuration["inverse"](self.projection)

    @cached_property
    def corners(self) -> list[Any]:
        """Return the frustum's eight corners [m]."""
        return self.configuration["corners"](self)


class Viewpoint:
    """A frame as the rays' formulas see it: its numbers as parameters of the kernel."""

    def __init__(self, frame: Frame, parameters: KernelConstants) -> None:
        self._frame, self._parameters = frame, parameters

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._frame, name)
        return self._parameters(f"camera {name}", value) if dr.is_array_v(value) else value
