"""How much memory a bench scene takes, in a process of its own.

`python -m tests.benchmarks.bench.memory bumpy_1300k 1920 1080` tells it in MB above what the imports and the
compiler take: the most while the scene is loaded and its first image rendered, and what is kept. Both count the mesh
itself. They are the kernel's own figures, so this works on Linux only.
"""

import sys
from pathlib import Path


def _status(name: str) -> float:
    """Return a line of the process's status [MB]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1]) / 1024


def memory(name: str, width: int, height: int) -> tuple[float, float]:
    """Return the peak and what is kept [MB] above the imports; raise LookupError for an unknown scene."""
    # The tracer comes first: it names the LLVM that Dr.Jit takes when it is imported.
    from rayproof.tracer.frames import Frames  # isort: skip

    import drjit as dr

    from rayproof.cases import benchmark_scenes
    from rayproof.cases.benchmark_scenes import SCENES, chosen
    from rayproof.tracer.configuration import Configuration

    Frames(SCENES[0].scene(16, 16), Configuration())()
    benchmark_scenes.bumpy(0)  # trimesh is an import, too
    before = _status("VmRSS")
    scene = chosen((name,), quick=False)[0].scene(width, height)
    for made in vars(benchmark_scenes).values():
        if hasattr(made, "cache_clear"):
            made.cache_clear()
    # What trimesh took to make the mesh is not ours.
    Path("/proc/self/clear_refs").write_text("5")
    frames = Frames(scene, Configuration())
    for _ in range(2):
        frames()
        dr.sync_thread()
    return _status("VmHWM") - before, _status("VmRSS") - before


if __name__ == "__main__":
    peak, kept = memory(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    sys.stdout.write(f"{' '.join(sys.argv[1:])}: peak {peak:.0f} MB above the imports, {kept:.0f} MB kept\n")
