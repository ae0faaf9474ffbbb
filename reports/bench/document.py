"""The benchmark's JSON: machine, scenes, every contender on each, as docs/bench.md describes it."""

from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from cases.scene import Scene
from reports.bench import CONTENDERS
from reports.bench.errors import error, sampled
from reports.bench.limits import limit
from reports.bench.measuring import CONTROL, DIRECT, MINIMAL, OURS, Timed, differing, ratio, timed
from reports.bench.scenes import BenchScene

SCHEMA = 1


def begun(machine: dict[str, Any]) -> dict[str, Any]:
    """Return the document of a benchmark without its scenes, on a `machine` with these peaks."""
    return {
        "schema": SCHEMA,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": {name: version(name) for name in ("rayproof", "drjit", "mitsuba", "embreex", "pyradiance")},
        "machine": machine,
        "scenes": [],
    }


def entry(
    bench: BenchScene,
    scene: Scene,
    names: tuple[str, ...],
    peaks: dict[str, Any],
    budget: float,
) -> dict[str, Any]:
    """Return what is said of one scene: times, ratios and errors; `budget` [s] goes to the rounds."""
    camera = scene.camera
    found = timed(scene, names, budget=budget)
    pixels, truth = sampled(scene)
    ours = found[OURS]
    kernels = ours.prepared.kernels() if ours.prepared is not None and ours.prepared.kernels is not None else ()
    minimal, direct, control = (ratio(found, others) for others in (MINIMAL, DIRECT, (CONTROL,)))
    return {
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
        **(limit(scene, kernels, peaks) or {"limit_fraction": None, "limit_by": None}),
        "contenders": {name: _contender(found[name], pixels, truth) for name in found},
    }


def _ms(one: Timed) -> float:
    return 1e3 * one.median if one.seconds else float("nan")


def _contender(one: Timed, pixels: Any, truth: Any) -> dict[str, Any]:
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


def everybody(*, quick: bool) -> tuple[str, ...]:
    """Return the contenders of a benchmark; a quick one does without those that take seconds a picture."""
    slow = {"radiance", "povray", "mitsuba_scalar", "embree"}
    return tuple(name for name in CONTENDERS if not quick or name not in slow)
