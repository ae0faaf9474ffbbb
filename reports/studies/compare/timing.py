"""Run times of contenders on one scene: warm kernels, interleaved in random order, compile time apart.

A time is what Dr.Jit's kernel history says the kernels of one launch took, so neither tracing in Python nor the copy
back counts. Source of the method: Chen and Revels, "Robust benchmarking in noisy environments" (2016): timings are
not independent and identically distributed, so ratios are taken within a repetition.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.light_path import Trace, images

RAYS = 2**18  # a launch of fewer measures the launch
LONGEST = 0.02  # s; a slower kernel gets fewer rays


@dataclass(frozen=True, kw_only=True)
class Times:
    """The launches of several contenders on one scene."""

    rays: int
    seconds: np.ndarray = field(repr=False)  # (contenders, repetitions)
    compile_seconds: tuple[float, ...]  # of each contender's first launch; 0 where the kernel was known


@dataclass(frozen=True, kw_only=True)
class Job:
    """A scene to be rendered up to some stages by several contenders."""

    scene: Scene
    stages: tuple[Stage, ...]
    configurations: tuple[Configuration, ...]


def enlarged(scene: Scene, rays: float) -> Scene:
    """Return the scene with the same view and at least `rays` pixels, never fewer than it has."""
    camera = scene.camera
    factor = max(1, int(np.ceil(np.sqrt(rays / (camera.width * camera.height)))))
    return replace(scene, camera=replace(camera, width=camera.width * factor, height=camera.height * factor))


def warmed(job: Job) -> tuple[Scene, tuple[float, ...]]:
    """Return the job's scene with as many rays as a launch of reasonable length takes, and the seconds of compiling."""
    scene = enlarged(job.scene, RAYS)
    built = tuple(launch(scene, job.stages, one)[1] for one in job.configurations)
    seconds = launch(scene, job.stages, job.configurations[0])[0]
    if seconds > LONGEST:
        # The image's size is a constant of the kernel: another size is another kernel.
        scene = enlarged(job.scene, RAYS * LONGEST / seconds)
        for one in job.configurations:
            launch(scene, job.stages, one)
    return scene, built


def launch(scene: Scene, stages: Sequence[Stage], configuration: Configuration) -> tuple[float, float]:
    """Return the seconds that the kernels of one launch ran, and those that they took to compile."""
    found = images(Trace.of(scene, configuration, per_side=1), stages)
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        dr.eval(found)
        dr.sync_thread()
        kernels = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    ran = sum(kernel["execution_time"] for kernel in kernels)
    built = sum(kernel["codegen_time"] + kernel["backend_time"] for kernel in kernels if not kernel["cache_hit"])
    return ran * 1e-3, built * 1e-3


def interleaved(jobs: Sequence[Job], *, repetitions: int, generator: np.random.Generator) -> list[Times]:
    """Return the times of each job's contenders; every repetition visits all jobs and contenders in a new order."""
    scenes, built = zip(*map(warmed, jobs), strict=True)
    seconds = [np.empty((len(job.configurations), repetitions)) for job in jobs]
    for repetition in range(repetitions):
        for number in generator.permutation(len(jobs)):
            job = jobs[number]
            for index in generator.permutation(len(job.configurations)):
                one = job.configurations[index]
                seconds[number][index, repetition] = launch(scenes[number], job.stages, one)[0]
    return [
        Times(rays=scene.camera.width * scene.camera.height, seconds=times, compile_seconds=compiled)
        for scene, times, compiled in zip(scenes, seconds, built, strict=True)
    ]
