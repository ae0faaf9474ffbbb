"""The benchmark's JSON: machine, scenes, every contender on each."""

from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

import numpy as np

from rayproof.cases.benchmark_scenes import BenchScene
from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from tests.benchmarks.bench import CONTENDERS, Prepared
from tests.benchmarks.bench.kernels import Kernel, loops, shared
from tests.benchmarks.bench.limits import limit
from tests.benchmarks.bench.measuring import CONTROL, DEFAULT, DIRECT, MINIMAL, OURS, Timed, differing, ratio, timed
from tests.benchmarks.bench.records import (
    BenchRecord,
    ContenderRecord,
    ErrorRecord,
    LimitRecord,
    MachineRecord,
    SceneRecord,
)

SCHEMA = 1
UNKNOWN_LIMIT: LimitRecord = {"limit_fraction": None, "limit_by": None, "limit_sum_fraction": None}
TESTS = 2**28  # ray-triangle tests that the oracle may make for one scene; it has no tree
MOST = 4096  # pixels
LEAST = 64
SEED = 11


def sampled(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return pixels (n, 2) as column and row, and the oracle's radiance there (n, 3) [W/(m^2 sr)]."""
    camera = scene.camera
    each = sum(len(shape.faces) if isinstance(shape, Mesh) else 1 for shape in scene.shapes) * (1 + len(scene.lights))
    count = int(np.clip(TESTS // each, LEAST, min(MOST, camera.width * camera.height)))
    chosen = np.random.default_rng(SEED).choice(camera.width * camera.height, size=count, replace=False)
    pixels = np.stack([chosen % camera.width, chosen // camera.width], axis=1)
    return pixels, np.asarray(Analytic().at(scene, [Stage.RADIANCE], pixels + 0.5)[Stage.RADIANCE])


def error(one: Timed, pixels: np.ndarray, truth: np.ndarray) -> ErrorRecord | None:
    """Return median and 99th percentile of the relative error where both are lit, and how many disagree on that."""
    if one.prepared is None or one.prepared.image is None:
        return None
    ours = np.asarray(one.prepared.image(), dtype=np.float64)[pixels[:, 1], pixels[:, 0]]
    lit, true = ours.max(axis=-1) > 0, truth.max(axis=-1) > 0
    both = lit & true
    if not both.any():
        return None
    relative = (np.abs(ours - truth)[both] / np.where(truth[both] > 0, truth[both], 1.0)).max(axis=-1)
    return {
        "median": float(np.median(relative)),
        "p99": float(np.quantile(relative, 0.99)),
        "pixels": int(both.sum()),
        "disagree": int((lit != true).sum()),
    }


def begun(machine: MachineRecord) -> BenchRecord:
    """Return the document of a benchmark without its scenes, on a `machine` with these peaks."""
    return {
        "schema": SCHEMA,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": {name: version(name) for name in ("rayproof", "drjit", "mitsuba", "pyradiance")},
        "machine": machine,
        "scenes": [],
    }


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What is timed of one scene."""

    found: dict[str, Timed]
    kernels: tuple[Kernel, ...]  # of one frame of ours


def measured(scene: Scene, names: tuple[str, ...], budget: float) -> Measured:
    """Time everybody on a scene; `budget` [s] goes to the rounds."""
    found = timed(scene, names, budget=budget)
    ours = found[OURS].prepared
    return Measured(found=found, kernels=() if ours is None or ours.kernels is None else ours.kernels())


def _counted(kernels: tuple[Kernel, ...], ours: Prepared | None) -> tuple[Kernel, ...]:
    """Return the kernels with the share of packets that take each branch, where that says how often their code runs."""
    if ours is None or ours.asked is None or any(loops(kernel.code) for kernel in kernels):
        return kernels
    return shared(kernels, ours.asked())


def entry(bench: BenchScene, scene: Scene, timing: Measured, peaks: MachineRecord) -> SceneRecord:
    """Return what is said of one scene: times, ratios and errors."""
    camera, found = scene.camera, timing.found
    pixels, truth = sampled(scene)
    ours = found[OURS]
    kernels = _counted(timing.kernels, ours.prepared)
    minimal, direct, control = (ratio(found, others) for others in (MINIMAL, DIRECT, (CONTROL,)))
    default = ratio(found, (DEFAULT,))
    record: SceneRecord = {
        "name": bench.name,
        "about": bench.about,
        "width": camera.width,
        "height": camera.height,
        "lights": len(scene.lights),
        "ours_ms": _ms(ours),
        "minimal_ms": min(
            (_ms(found[name]) for name in MINIMAL if name in found and found[name].seconds), default=None
        ),
        "direct_ms": min((_ms(found[name]) for name in DIRECT if name in found and found[name].seconds), default=None),
        "ratio_minimal": minimal["ratio"] if minimal else None,
        "ratio_minimal_interval": minimal["interval"] if minimal else None,
        "ratio_minimal_by": minimal["by"] if minimal else None,
        "ratio_direct": direct["ratio"] if direct else None,
        "ratio_direct_interval": direct["interval"] if direct else None,
        "control": control["ratio"] if control else None,
        "control_interval": control["interval"] if control else None,
        "pixels_differ": differing(found),
        "error": error(ours, pixels, truth),
        "compile_ms": 1e3 * ours.first_seconds,
        "build_ms": 1e3 * ours.build_seconds,
        "kernel_ms": 1e3 * sum(kernel.seconds for kernel in kernels),
        "operations": sum(kernel.operations for kernel in kernels),
        **(limit(scene, kernels, peaks) or UNKNOWN_LIMIT),
        "contenders": {name: _contender(found[name], pixels, truth) for name in found},
    }
    if default:
        record["default"], record["default_interval"] = default["ratio"], default["interval"]
    return record


def _ms(one: Timed) -> float:
    return 1e3 * one.median if one.seconds else float("nan")


def _contender(one: Timed, pixels: Any, truth: Any) -> ContenderRecord:
    if one.left_out is not None:
        return {"left_out": one.left_out}
    return {
        "does": one.does,
        "ms": _ms(one),
        "fastest_ms": 1e3 * min(one.seconds),
        "rounds": len(one.seconds),
        "first_ms": 1e3 * one.first_seconds,
        "build_ms": 1e3 * one.build_seconds,
        "error": error(one, pixels, truth),
    }


def everybody(*, quick: bool, formulas: bool = False) -> tuple[str, ...]:
    """Return the contenders of a benchmark; a quick one does without those that take seconds a picture.

    Our default formulas are one of them where it is about other `formulas`.
    """
    left_out = {"radiance", "mitsuba_scalar"} if quick else set()
    return tuple(name for name in CONTENDERS if name not in left_out and (formulas or name != DEFAULT))
