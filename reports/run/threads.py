"""How many threads a worker's Dr.Jit has: the worker's own alone, where an image is small.

The others look for work in a loop before they sleep, and a suite's kernels are brief: with one thread more, two fifths
of the tracer's processor time went into that loop, and it was the run's other workers that had to wait for it.
"""

import os

import drjit as dr

from cases.scene import Scene

SMALL = 2**17  # samples that one thread traces sooner than it compiles how


def set_threads(scene: Scene, samples: int) -> None:
    """Let kernels for samples x samples points per pixel run on this thread, or on all processors' where they last."""
    small = scene.camera.width * scene.camera.height * samples * samples < SMALL
    dr.set_thread_count(1 if small else os.cpu_count() or 1)
