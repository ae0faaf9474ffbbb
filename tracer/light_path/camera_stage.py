"""The camera stage on the device: frame, sample positions, view rays and their clip interval.

The camera on the device: everything that belongs to the camera and not to a pixel, computed once and as literals.

The camera's rays through the samples of an image, and the part of each that counts.

Lists have an entry for each of a lane's samples.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from rayproof.cases.scene import Camera
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes, Lanes, next_step
from rayproof.tracer.kernel.parameters import KernelConstants
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Interval, Ray


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
    """Return the frame of a camera; `half_extent` replaces the half-sizes that follow from fovy and aspect."""
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
    """A frame for the formulas of rays: its numbers as parameters of the kernel, each uploaded at its first use."""

    def __init__(self, frame: Frame, parameters: KernelConstants) -> None:
        self._frame, self._parameters = frame, parameters

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._frame, name)
        return self._parameters(f"camera {name}", value) if dr.is_array_v(value) else value


WIDEST = 0.25  # the largest component of a unit direction is at least 0.57; its neighbour's, at least 0.3


@dataclass(frozen=True, kw_only=True)
class SampledView:
    """The samples that each lane takes of a camera's image.

    Without `within` these are all samples of the image; with it, one sample of every pixel: the one at this (column,
    row) of the pixel's per_side x per_side samples.
    """

    context: Context
    lanes: Lanes
    per_side: int
    within: tuple[Any, Any] | None
    frame: Frame
    viewpoint: Viewpoint  # the frame's numbers as parameters of the kernel

    @classmethod
    def of(
        cls, context: Context, *, columns: int, rows: int, per_side: int, within: tuple[Any, Any] | None
    ) -> "SampledView":
        """Return the view of a scene's camera by lanes that take columns x rows samples."""
        camera, side_by_side = context.scene.camera, per_side if within is None else 1
        size = {"width": camera.width * side_by_side, "height": camera.height * side_by_side}
        frame = camera_frame(camera, context.configuration, context.types)
        return cls(
            context=context,
            lanes=Lanes(**size, columns=columns, rows=rows),
            per_side=per_side,
            within=within,
            frame=frame,
            viewpoint=Viewpoint(frame, context.parameters),
        )

    @property
    def narrow(self) -> bool:
        """Return whether the directions of a lane's rays differ by less than WIDEST."""
        camera, lanes = self.context.scene.camera, self.lanes
        return is_narrow(camera, max(lanes.columns, lanes.rows), per_side=lanes.width // camera.width)

    def end(self, *values: Any) -> None:
        """End a stage of these samples, which has made `values`."""
        self.context.parameters.store(*values)
        next_step(self.context.types, samples=self.lanes.tile)


def is_narrow(camera: Camera, across: int, *, per_side: int) -> bool:
    """Return whether the directions through columns x rows neighbouring samples differ by less than WIDEST.

    There are `per_side` samples to a side of a pixel.
    """
    sample = 2 * math.tan(math.radians(camera.fovy) / 2) / (camera.height * per_side)
    return across * sample < WIDEST and camera.fovy < 90


def sample_positions(view: SampledView) -> list[tuple[Any, Any]]:
    """Return (column, row) of every sample among all samples of the image."""
    positions = view.lanes.positions(view.context.types.UInt)
    if view.within is None:
        return positions
    across, down = view.within
    return [(column * view.per_side + across, row * view.per_side + down) for column, row in positions]


def sample_ndc(view: SampledView, positions: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """Return (sx, sy) of the samples at these positions."""
    context, camera = view.context, view.context.scene.camera
    types, configuration = context.types, context.configuration
    coordinates = []
    for position in positions:
        # As signed integers: there is an instruction that converts those.
        column, row = (types.Int(place) for place in position)
        column, row = types.Float(column), types.Float(row)
        px, py = configuration["sample"](column, row, view.per_side)
        if any(camera.sample_offset):
            px, py = (place + move / view.per_side for place, move in zip((px, py), camera.sample_offset, strict=True))
        coordinates.append(configuration["ndc"](px, py, camera.width, camera.height))
    return coordinates


def camera_rays(view: SampledView, ndc: list[tuple[Any, Any]]) -> list[Ray]:
    """Return the camera rays through these points of the image, with unit directions, and let a kernel end."""
    formula, viewpoint = view.context.configuration["ray"], view.viewpoint
    rays = [Ray(origin=viewpoint.eye, direction=formula(viewpoint, *point)) for point in ndc]
    view.end([ray.direction for ray in rays])
    return rays


def clipped(view: SampledView, rays: list[Ray]) -> list[Interval]:
    """Return the interval of each camera ray between the clip planes; a kernel may end after it."""
    context, viewpoint = view.context, view.viewpoint
    clip = context.configuration[f"clip_{context.scene.clip}"]
    intervals = []
    for ray in rays:
        ends = clip(ray.direction, viewpoint.forward, viewpoint.near, viewpoint.far)
        width = dr.width(ray.direction)
        near, far = (context.parameters.per_lane(context.types.Float(end), width) for end in ends)
        intervals.append(Interval(nearest=near, farthest=far))
    view.end([(interval.nearest, interval.farthest) for interval in intervals])
    return intervals
