"""The camera's rays through the samples of an image, and the part of each that counts."""

import math
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.tracer.context import Context
from rayproof.tracer.device.scheduling import next_step
from rayproof.tracer.device.tiles import Lanes
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.stages.camera_frame import Frame, Viewpoint

WIDEST = 0.25  # the largest component of a unit direction is at least 0.57, and that of its neighbour 0.3


class CameraRays:
    """One ray for each sample of a lane; every quantity is a list with an entry for each of them.

    All samples of the image are there side by side or, with `within`, that one of every pixel: its (column, row) among
    the pixel's per_side x per_side.
    """

    def __init__(
        self, context: Context, *, columns: int, rows: int, per_side: int, within: tuple[Any, Any] | None
    ) -> None:
        self.scene, self.configuration, self.types = context.scene, context.configuration, context.types
        self.per_side, self.within, self._parameters = per_side, within, context.parameters
        camera = self.scene.camera
        self.frame = Frame(camera=camera, configuration=self.configuration, types=self.types)
        self._seen_from = Viewpoint(self.frame, self._parameters)
        self._side_by_side = per_side if within is None else 1
        size = {"width": camera.width * self._side_by_side, "height": camera.lines * self._side_by_side}
        self.lanes = Lanes(**size, columns=columns, rows=rows)

    @property
    def eye(self) -> Any:
        """Return where they begin [m]."""
        return self._seen_from.eye

    @cached_property
    def positions(self) -> list[tuple[Any, Any]]:
        """Return (column, row) of every sample among all samples of the image."""
        found = self.lanes.positions(self.types.UInt)
        if self.within is None:
            return found
        across, down = self.within
        return [(column * self.per_side + across, row * self.per_side + down) for column, row in found]

    @cached_property
    def ndc(self) -> list[tuple[Any, Any]]:
        """Return (sx, sy) of every sample."""
        camera, types = self.scene.camera, self.types
        found = []
        for position in self.positions:
            # As signed integers: there is an instruction that converts those.
            column, row = (types.Int(place) for place in position)
            if camera.rows is not None:
                row = row + self._parameters("first_row", types.Int(camera.first_row * self.per_side))
            column, row = types.Float(column), types.Float(row)
            px, py = self.configuration["sample"](column, row, self.per_side)
            found.append(self.configuration["ndc"](px, py, camera.width, camera.height))
        return found

    @cached_property
    def rays(self) -> list[Ray]:
        """Return the camera rays, with unit directions."""
        formula = self.configuration["ray"]
        found = [Ray(origin=self._seen_from.eye, direction=formula(self._seen_from, *ndc)) for ndc in self.ndc]
        self.end([ray.direction for ray in found])
        return found

    @cached_property
    def intervals(self) -> list[Interval]:
        """Return the part of each camera ray that counts."""
        clip, seen = self.configuration[f"clip_{self.scene.clip}"], self._seen_from
        intervals = []
        for ray in self.rays:
            ends = clip(ray.direction, seen.forward, seen.near, seen.far)
            width = dr.width(ray.direction)
            near, far = (self._parameters.per_lane(self.types.Float(end), width) for end in ends)
            intervals.append(Interval(nearest=near, farthest=far))
        self.end([(interval.nearest, interval.farthest) for interval in intervals])
        return intervals

    @property
    def narrow(self) -> bool:
        """Return whether the directions of a lane's rays differ by less than WIDEST."""
        camera, lanes = self.scene.camera, self.lanes
        pixel = 2 * math.tan(math.radians(camera.fovy) / 2) / (camera.height * self._side_by_side)
        return max(lanes.columns, lanes.rows) * pixel < WIDEST and camera.fovy < 90

    def end(self, *values: Any) -> None:
        """End a stage of these rays, which has made `values`."""
        self._parameters.store(*values)
        next_step(self.types, samples=self.lanes.tile)
