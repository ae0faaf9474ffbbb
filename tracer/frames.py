"""Only the image, warm: the radiance of one scene again and again, by a frozen function.

    frames = Frames(scene, configuration)
    image = frames()          # a Dr.Jit array, height x width x 3, row by row; evaluated, not copied
    pixels = frames.pixels()  # the same as numpy, (height, width, 3)

The first call traces and compiles; every later one launches the recorded kernels and does nothing else. What is
computed is what `tracer.render.render` computes for the same plan.
"""

from typing import Any

import drjit as dr
import numpy as np

from cases.scene import Scene
from tracer.arrays import ArrayTypes
from tracer.assets import Assets
from tracer.configuration import Configuration
from tracer.interleaving import next_step
from tracer.lanes import Lanes
from tracer.plan import Plan
from tracer.trace import Trace

PACKETS = (8, 4)  # numbers that are written at once, as many pixels as stand in a row
CHANNELS = 3


def _write(image: Any, numbers: list[Any], radiance: list[Any], lanes: Lanes, types: ArrayTypes) -> None:
    """Write a lane's pixels: several packets for as many neighbours as fill them, else one by one."""
    whole = [packet for packet in PACKETS if lanes.columns % packet == 0 and lanes.width % packet == 0]
    if not whole:
        for number, color in zip(numbers, radiance, strict=True):
            dr.scatter(image, color, number, mode=dr.ReduceMode.Permute)
        return
    packet = whole[0]
    next_step(types)
    for first in range(0, lanes.tile, packet):
        row = [channel for color in radiance[first : first + packet] for channel in color]
        for part in range(CHANNELS):
            values = types.Packet(row[part * packet : (part + 1) * packet])
            where = numbers[first] // packet * CHANNELS + part
            dr.scatter(image, values, where, mode=dr.ReduceMode.Permute)


def _image(scene: Scene, configuration: Configuration, chosen: Plan, arrays: dict[str, Any]) -> Any:
    """Return the image of one trace; a function of its own, so that `Frames` is no part of a reference cycle."""
    trace = Trace(scene, configuration, per_side=1, chosen=chosen, assets=Assets(dict(arrays)))
    lanes, types = trace.lanes, trace.types
    image = dr.empty(types.Float, lanes.width * lanes.height * CHANNELS)
    _write(image, lanes.numbers(trace.positions), trace.radiance, lanes, types)
    dr.eval(image)
    return image


class Frames:
    """A scene's radiance by one configuration, to be rendered many times; raises what `tracer.render.render` raises.

    `chosen` overrides the plan, to compare plans; without it the scene decides.
    """

    def __init__(self, scene: Scene, configuration: Configuration, *, chosen: Plan | None = None) -> None:
        self.scene, self.configuration = scene, configuration
        first = Trace(scene, configuration, per_side=1, chosen=chosen)
        self.plan = first.plan
        # Tracing uploads what the kernel will read; nothing is launched for the pixels yet.
        _ = first.radiance
        self._arrays: dict[str, Any] = {"nothing": dr.opaque(first.types.UInt, 0), **first.assets.arrays}
        dr.eval(self._arrays)
        # Dr.Jit aborts the process when the garbage collector finds a frozen function while another one is recorded.
        decided = first.plan

        def image(arrays: dict[str, Any]) -> Any:
            return _image(scene, configuration, decided, arrays)

        self._frozen = dr.freeze(image)

    def __call__(self) -> Any:
        """Return the image [W/(m^2 sr)], channels last, as one evaluated Dr.Jit array."""
        return self._frozen(self._arrays)

    def pixels(self) -> np.ndarray:
        """Return the image [W/(m^2 sr)], (height, width, 3), in the configuration's precision."""
        camera = self.scene.camera
        return np.array(self()).reshape(camera.height, camera.width, 3)
