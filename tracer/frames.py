"""`Frames`: repeated renders of one scene's radiance by a frozen Dr.Jit function.

    frames = Frames(scene, configuration, samples=2)  # 2 x 2 per pixel, their mean; without it one
    image = frames()          # a Dr.Jit array, height x width x 3, row by row; evaluated, not copied
    pixels = frames.pixels()  # the same as numpy, (height, width, 3)

The first call traces and compiles; every later call only launches the recorded kernels. The values are those of
`tracer.render.render` for the same plan.
"""

import gc
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes, Lanes, array_types, asked, next_step
from rayproof.tracer.kernel.parameters import DeviceBuffers
from rayproof.tracer.light_path import Trace, radiance
from rayproof.tracer.plan import Plan, plan

PACKETS = (8, 4)  # numbers that are written at once, one for each of as many neighbouring pixels in a row
CHANNELS = 3
Traces = Callable[[Any, Any], Trace]  # the trace of the sample at (column, row) of every pixel


def _write(image: Any, numbers: list[Any], radiance: list[Any], lanes: Lanes, types: ArrayTypes) -> None:
    """Write a lane's pixels: several packets for as many neighbours as fill them, else one by one."""
    whole = [packet for packet in PACKETS if lanes.columns % packet == 0 and lanes.width % packet == 0]
    if not whole:
        for number, color in zip(numbers, radiance, strict=True):
            dr.scatter(image, color, number, mode=dr.ReduceMode.Permute)
        return
    packet = whole[0]
    next_step(types, samples=lanes.tile)
    for first in range(0, lanes.tile, packet):
        row = [channel for color in radiance[first : first + packet] for channel in color]
        for part in range(CHANNELS):
            values = types.Packet(row[part * packet : (part + 1) * packet])
            where = numbers[first] // packet * CHANNELS + part
            dr.scatter(image, values, where, mode=dr.ReduceMode.Permute)


def _mean(traces: Traces, lanes: Lanes, per_side: int, types: ArrayTypes) -> list[Any]:
    """Return each pixel's mean over per_side x per_side samples, one after the other in a loop of the kernel."""
    count, width = per_side * per_side, lanes.count

    def step(index: Any, total: Any) -> tuple[Any, Any]:
        row = index // per_side
        sample = radiance(traces(index - row * per_side, row))
        return index + 1, [before + channel for before, channel in zip(total, sample, strict=True)]

    _, total = dr.while_loop(
        state=(dr.zeros(types.UInt, width), [dr.zeros(types.Vector, width) for _ in range(lanes.tile)]),
        cond=lambda index, total: index < count,
        body=step,
        labels=("index", "total"),
    )
    return [channel / count for channel in total]


def _decided(scene: Scene, configuration: Configuration, samples: int, chosen: Plan | None) -> Plan:
    """Return the plan. Several samples are traced in a loop, whose stages cannot be split: it is one kernel."""
    decided = plan(scene, configuration, samples=samples) if chosen is None else chosen
    if samples == 1 or not decided.split:
        return decided
    bounded = configuration.formula("segment").facts.get("bounded", False)
    side = {} if bounded else {"columns": 1, "rows": 1}
    return replace(decided, split=False, **side)


class _Recipe:
    """The scene, configuration and plan of a frozen function, hidden from Dr.Jit.

    At every call Dr.Jit searches all objects that a frozen function refers to for arrays, dataclasses included, which
    took milliseconds for a scene of a thousand shapes. It does not search an object of a plain class such as this.
    """

    def __init__(self, scene: Scene, configuration: Configuration, samples: int, chosen: Plan) -> None:
        self._scene, self._configuration, self.samples, self._chosen = scene, configuration, samples, chosen

    def trace(self, column: Any, row: Any, buffers: DeviceBuffers) -> Trace:
        """Return the trace of the sample at (column, row) of every pixel."""
        within = None if self.samples == 1 else (column, row)
        return Trace.of(
            self._scene,
            self._configuration,
            per_side=self.samples,
            within=within,
            chosen=self._chosen,
            buffers=buffers,
        )


def _image(recipe: _Recipe, arrays: dict[str, Any]) -> Any:
    """Return the image, by the arrays that the scene keeps on the device."""
    buffers, samples = DeviceBuffers(dict(arrays)), recipe.samples
    first = recipe.trace(0, 0, buffers)
    lanes, types = first.view.lanes, first.world.types
    if samples > 1:
        channels = _mean(lambda column, row: recipe.trace(column, row, buffers), lanes, samples, types)
    else:
        channels = radiance(first)
    image = dr.empty(types.Float, lanes.width * lanes.height * CHANNELS)
    _write(image, lanes.numbers(lanes.positions(types.UInt)), channels, lanes, types)
    dr.eval(image)
    return image


class Frames:
    """A scene's radiance by one configuration, to be rendered many times; raises what `tracer.render.render` raises.

    With samples > 1 a pixel is the mean over samples x samples points, the centres of a regular subdivision. `chosen`
    overrides the plan, to compare plans; without it the scene decides.
    """

    def __init__(
        self, scene: Scene, configuration: Configuration, *, samples: int = 1, chosen: Plan | None = None
    ) -> None:
        if samples < 1:
            raise ValueError(f"samples must be 1 or more, got {samples}")
        self.scene, self.configuration = scene, configuration
        self.plan = _decided(scene, configuration, samples, chosen)
        buffers, recipe = DeviceBuffers(), _Recipe(scene, configuration, samples, self.plan)
        # Tracing uploads the arrays that the kernel will read; nothing is launched for the pixels yet. The sample is
        # opaque because Dr.Jit would simplify the code for a literal index, as in an image of one pixel.
        any_sample = dr.opaque(array_types(configuration.precision).UInt, 0)
        first = recipe.trace(any_sample, any_sample, buffers)
        radiance(first)
        self._arrays: dict[str, Any] = {"nothing": dr.opaque(first.world.types.UInt, 0), **buffers.arrays}
        dr.eval(self._arrays)

        self._recipe = recipe

        # It must not refer to `self`: Dr.Jit searches everything that a frozen function refers to at every call.
        def image(arrays: dict[str, Any]) -> Any:
            return _image(recipe, arrays)

        self._frozen = dr.freeze(image)

    def __call__(self) -> Any:
        """Return the image [W/(m^2 sr)], channels last, as one evaluated Dr.Jit array."""
        # Dr.Jit aborts the process when the garbage collector finds arrays or a frozen function while one is recorded.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return self._frozen(self._arrays)
        finally:
            if collecting:
                gc.enable()

    def asked(self) -> list[np.ndarray]:
        """Return, for each branch in the order of the code, the mask of lanes that need it: (lanes,) bool, or (1,)."""
        with asked() as conditions:
            radiance(self._recipe.trace(0, 0, DeviceBuffers(dict(self._arrays))))
        # All at once: evaluated one by one, each would have a kernel that repeats all operations before it.
        dr.eval(conditions)
        return [np.array(condition) for condition in conditions]

    def pixels(self) -> np.ndarray:
        """Return the image [W/(m^2 sr)], (height, width, 3), in the configuration's precision."""
        camera = self.scene.camera
        return np.array(self()).reshape(camera.height, camera.width, CHANNELS)
