"""`python -m tests.benchmarks.bench.oracle_speed`: how fast the two truths answer a scene, in pixels per second.

Seconds are of the wall, and of the processor, since the machine may be shared.
"""

import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import isqrt
from multiprocessing import get_context
from pathlib import Path
from typing import TypedDict

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.commands.lookup import scene_named
from rayproof.reports.commands.output import show_table, write_json
from tests.command_line import call

ROUNDS = 3
LANES = 2**20  # rays of one launch
MOST_TESTS = 2**25  # of rays against triangles, in one launch: some seconds


class SpeedRecord(TypedDict):
    """What `--json` writes of a truth that answers."""

    pixels: int
    processes: int
    seconds: float
    processor_seconds: float
    pixels_per_second: float
    pixels_per_processor_second: float


@dataclass(frozen=True, kw_only=True)
class Speed:
    """The best of a few rounds: a busy machine only ever makes them slower."""

    pixels: int
    processes: int
    seconds: float  # of the wall
    processor_seconds: float  # of all threads and processes

    def as_json(self) -> SpeedRecord:
        """Return plain JSON data, with the two rates."""
        return {
            "pixels": self.pixels,
            "processes": self.processes,
            "seconds": self.seconds,
            "processor_seconds": self.processor_seconds,
            "pixels_per_second": self.pixels / self.seconds,
            "pixels_per_processor_second": self.pixels / self.processor_seconds,
        }


def speeds(scene: Scene) -> Mapping[str, Speed | str]:
    """Return the speed of each truth on a scene, or the sentence that says why it cannot answer.

    `certified` is asked for every stage of the scene's own pixels, `double_double` for the radiance, which passes
    through every stage, at 2^20 image points in the order of an image: on fewer the launch itself is what one would
    measure. Large meshes have to do with fewer.
    """
    from rayproof.reference.certified import Certified
    from rayproof.reference.double_double import DoubleDouble

    certified, pairs = Certified(), DoubleDouble()
    found: dict[str, Speed | str] = {}
    if (reason := certified.unsupported(scene, Stage.RADIANCE)) is not None:
        found["certified"] = reason
    else:
        found["certified"] = _best(lambda: _whole_image(scene))
        with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
            list(pool.map(_whole_image, [scene] * 2))  # starts the processes
            found["certified, two processes"] = _best(lambda: _by_two(pool, scene))
    if (reason := pairs.unsupported(scene, Stage.RADIANCE)) is not None:
        found["double_double"] = reason
    else:
        triangles = sum(len(getattr(shape, "faces", ())) for shape in scene.shapes)
        lanes = min(LANES, MOST_TESTS // max(1, triangles))
        points = _raster(scene, lanes)
        found["double_double"] = _best(lambda: _launch(scene, points), after=1)
    return found


def _raster(scene: Scene, count: int) -> np.ndarray:
    """Return image points (count, 2) [px] all over the image, row after row."""
    columns = max(1, isqrt(count * scene.camera.width // scene.camera.height))
    down, across = np.divmod(np.arange(count), columns)
    scale = scene.camera.width / columns, scene.camera.height / (down[-1] + 1)
    return (np.stack([across, down], axis=1) + 0.5) * scale


def _best(work: Callable[[], tuple[int, int, float]], *, after: int = 0) -> Speed:
    """Return the fastest round by processor time; `after` rounds are not counted, for kernels are compiled in them."""
    rounds = []
    for _ in range(after + ROUNDS):
        started, used = time.perf_counter(), time.process_time()
        pixels, processes, elsewhere = work()
        rounds.append(
            Speed(
                pixels=pixels,
                processes=processes,
                seconds=time.perf_counter() - started,
                processor_seconds=time.process_time() - used + elsewhere,
            )
        )
    return min(rounds[after:], key=lambda one: one.processor_seconds)


def _whole_image(scene: Scene) -> tuple[int, int, float]:
    """Certify every stage of every pixel; return pixels, processes, and 0 for processor time spent elsewhere."""
    from rayproof.reference.certified import Certified

    Certified().render(scene, IMAGE_STAGES)
    return scene.camera.width * scene.camera.height, 1, 0.0


def _used_by(scene: Scene) -> float:
    started = time.process_time()
    _whole_image(scene)
    return time.process_time() - started


def _by_two(pool: ProcessPoolExecutor, scene: Scene) -> tuple[int, int, float]:
    used = sum(pool.map(_used_by, [scene] * 2))
    return 2 * scene.camera.width * scene.camera.height, 2, used


def _launch(scene: Scene, points: np.ndarray) -> tuple[int, int, float]:
    from rayproof.reference.double_double import DoubleDouble

    DoubleDouble().at(scene, [Stage.RADIANCE], points)
    return len(points), 1, 0.0


def oracle_speed(scene: str, *, json: Path | None = None) -> int:
    """Measure how many pixels per second the certified oracle and the double-double one answer.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    json
        Also write the figures to this file.

    """
    loaded = scene_named(scene)
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    found = speeds(loaded)
    content = {who: {"unsupported": one} if isinstance(one, str) else one.as_json() for who, one in found.items()}
    write_json(json, {"scene": scene, "shapes": len(loaded.shapes), "lights": len(loaded.lights), "speeds": content})
    rows = []
    for who, one in found.items():
        if isinstance(one, str):
            rows.append([who, "", "", "", one])
            continue
        rates = one.as_json()
        per_second, per_processor = (
            f"{rates[key]:,.0f}" for key in ("pixels_per_second", "pixels_per_processor_second")
        )
        rows.append([who, f"{one.pixels}", per_second, per_processor, ""])
    show_table(
        f"{scene}: {len(loaded.shapes)} shapes, {len(loaded.lights)} lights",
        ["truth", "pixels", "pixels / s", "pixels / processor s", ""],
        rows,
    )
    return 0


if __name__ == "__main__":
    sys.exit(call(oracle_speed))
