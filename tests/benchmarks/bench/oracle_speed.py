"""`python -m tests.benchmarks.bench.oracle_speed`: how fast `certified` answers a scene, in pixels per second.

Seconds are of the wall, and of the processor, since the machine may be shared.
"""

import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TypedDict

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.commands.lookup import scene_named
from rayproof.reports.commands.output import show_table, write_json
from tests.command_line import call

ROUNDS = 3


class SpeedRecord(TypedDict):
    """The content of `--json` about a scene that is answered."""

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
    """Return the speed of `certified` on every stage of a scene, or the sentence that says why it cannot answer."""
    from rayproof.reference.certified import Certified

    if (reason := Certified().unsupported(scene, Stage.RADIANCE)) is not None:
        return {"certified": reason}
    alone = _best(lambda: _whole_image(scene))
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(_whole_image, [scene] * 2))  # starts the processes
        return {"certified": alone, "certified, two processes": _best(lambda: _by_two(pool, scene))}


def _best(work: Callable[[], tuple[int, int, float]]) -> Speed:
    """Return the fastest round by processor time."""
    rounds = []
    for _ in range(ROUNDS):
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
    return min(rounds, key=lambda one: one.processor_seconds)


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


def oracle_speed(scene: str, *, json: Path | None = None) -> int:
    """Measure how many pixels per second `certified` answers.

    Parameters
    ----------
    scene
        A scene file ending in .json, or the name of a case.
    json
        Also write the figures to this file.

    """
    loaded = scene_named(scene)
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
